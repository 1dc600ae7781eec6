mod golden;
mod probes;
