//! Settings -> a number that tells them apart, the same in every release. Pure.
//!
//! What an estimator remembers means something else under other settings. The text that is hashed is nowhere: many
//! sensors are born at once.

use super::plan::EstimationSettings;
use super::preparation::Prepared;
use crate::frames::AxisMap;
use crate::{condition, propagate};
use std::fmt::{self, Write};

/// FNV-1a of what is written to it.
struct Fnv(u64);

impl Write for Fnv {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        self.0 = part.bytes().fold(self.0, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Ok(())
    }
}

/// The number of every setting under which what is remembered means something else.
pub(super) fn settings_fingerprint(
    settings: &condition::Settings,
    plan: &EstimationSettings,
    prepared: &Prepared,
    noise: &propagate::Noise,
) -> u64 {
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    let mut write = || {
        settings.tell(&mut hash)?;
        write!(hash, " {:?} {:?}", plan.method, prepared.world_rate)?;
        write!(hash, " {noise:?}")?;
        // Nothing for a gyro alone: what was saved before there was more goes on.
        if let Some(aiding) = &prepared.aiding {
            write!(hash, " {:?} {:?}", aiding.settings, aiding.start)?;
            write!(hash, " {} {}", aiding.force_scale, plan.declination)?;
            write!(hash, " {:?}", plan.mag_mount.map(|q_bs| q_bs.wxyz()))?;
            if plan.mag_axes != AxisMap::IDENTITY {
                write!(hash, " {}", plan.mag_axes)?;
            }
        }
        match &plan.calibration {
            Some(known) => write!(hash, " {known:?}"),
            None => Ok(()),
        }
    };
    // Nothing is written anywhere that could fail.
    let _: fmt::Result = write();
    hash.0
}
