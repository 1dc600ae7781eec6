//! Summary of a simulation -> text or JSON. Pure.

use super::{human_bytes, human_count, line, meaning};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use strapd_attitude::record::SampleKind;
use strapd_attitude::setting::{NOISE, RATE_HZ, START_STAMP};
use strapd_bodies::synthetic::GenerationCounts;

/// Summary of a simulation.
#[derive(Clone, Debug)]
pub struct SimulationSummary {
    /// The motion.
    pub name: String,
    /// Counts.
    pub noticed: GenerationCounts,
    /// Kind of a sample.
    pub kind: SampleKind,
    /// Samples a second.
    pub rate_hz: f64,
    /// Everything that decided the samples.
    pub parameters: Vec<(String, String)>,
    /// Things to know about them.
    pub notes: Vec<String>,
    /// Stamps ROS messages cannot carry.
    pub stamps_out_of_range: u64,
    /// Outputs: name, bytes, messages.
    pub outputs: Vec<(String, u64, u64)>,
    /// Sockets that broke before the end.
    pub broken: Vec<String>,
    /// Whether the readers of every output hung up before the end.
    pub reader_gone: bool,
    /// Wall seconds.
    pub elapsed_secs: f64,
}

impl SimulationSummary {
    /// Warnings for the user, each with the flag that helps.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.notes.clone();
        let n = self.noticed;
        if n.undersampled > 0 {
            warnings.push(format!(
                "{} of {} steps turn half a turn or more: no one can tell which way; {RATE_HZ} above {:.0}",
                n.undersampled,
                n.instants,
                n.fastest / std::f64::consts::PI
            ));
        }
        if n.saturated > 0 {
            warnings.push(format!(
                "{} of {} samples are at the end of the sensor's range; {NOISE} PRESET,range=DEG_S widens it",
                n.saturated, n.samples
            ));
        }
        if n.force_saturated > 0 {
            warnings.push(format!(
                "{} of {} specific forces are at the end of the accelerometer's range; {NOISE} PRESET,accel-range=G widens it",
                n.force_saturated, n.samples
            ));
        }
        if self.stamps_out_of_range > 0 {
            warnings.push(format!(
                "{} stamps do not fit into the 32-bit seconds of ROS messages (1901 to 2038); {START_STAMP}",
                self.stamps_out_of_range
            ));
        }
        warnings
    }

    fn samples_per_sec(&self) -> f64 {
        self.noticed.samples as f64 / self.elapsed_secs.max(1e-9)
    }

    /// Text for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = format!("simulated {}\n", self.name);
        let n = self.noticed;
        let secs = n.instants.saturating_sub(1) as f64 / self.rate_hz;
        line(
            &mut out,
            "samples",
            &format!(
                "{}{} at {} Hz over {secs} s; {}",
                n.samples,
                if n.dropped > 0 {
                    format!(" ({} lost)", n.dropped)
                } else {
                    String::new()
                },
                self.rate_hz,
                meaning(self.kind)
            ),
        );
        for (key, value) in &self.parameters {
            line(&mut out, &key.replace('_', " "), value);
        }
        line(
            &mut out,
            "speed",
            &format!(
                "{:.2} s, {} samples/s",
                self.elapsed_secs,
                human_count(self.samples_per_sec())
            ),
        );
        for (name, bytes, messages) in &self.outputs {
            let text = format!("{name}  {}, {messages} messages", human_bytes(*bytes));
            line(&mut out, "output", &text);
        }
        for warning in self.warnings() {
            line(&mut out, "note", &warning);
        }
        out
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let n = self.noticed;
        let parameters: BTreeMap<_, _> = self.parameters.iter().cloned().collect();
        json!({
            "motion": self.name,
            "instants": n.instants,
            "samples": n.samples,
            "dropped": n.dropped,
            "saturated": n.saturated,
            "force_saturated": n.force_saturated,
            "fields": n.fields,
            "rate_hz": self.rate_hz,
            "sample_kind": self.kind.name(),
            "fastest_rad_s": n.fastest,
            "undersampled": n.undersampled,
            "parameters": parameters,
            "warnings": self.warnings(),
            "outputs": self.outputs.iter().map(|(name, bytes, messages)|
                json!({ "name": name, "bytes": bytes, "messages": messages })).collect::<Vec<_>>(),
            "elapsed_s": self.elapsed_secs,
            "samples_per_s": self.samples_per_sec(),
        })
    }
}
