//! Policies of repair: whether wrong stamps, and wrong single rates, are mended. Pure.
//!
//! A file of its own because the settings and the stages that repair stand on it.

/// Treatment of spikes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum SpikePolicy {
    /// Replace them by the line between their neighbours.
    #[default]
    Repair,
    /// Leave them as recorded.
    Keep,
}

impl SpikePolicy {
    /// The name used by `--spikes`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            SpikePolicy::Repair => "repair",
            SpikePolicy::Keep => "keep",
        }
    }
}

/// Treatment of stamps whose clock does not run on evenly (`--stamps`).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum StampRepair {
    /// Stamps go on where their counter wraps, and where their clock was set while that of the recorder went on; those
    /// of batches and of coarse clocks are spread; those that stand still, or by which gravity does not, give way to the
    /// log time.
    #[default]
    Auto,
    /// Stamps as recorded.
    AsRecorded,
}

impl StampRepair {
    /// The name used by `--stamps`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            StampRepair::Auto => "auto",
            StampRepair::AsRecorded => "as-recorded",
        }
    }
}
