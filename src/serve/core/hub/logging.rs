//! Doubts about a sensor -> the log. I/O.

use crate::serve::core::stream::SensorStream;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::log_throttle;
use strapd_attitude::estimate::EstimationSettings;

/// Logs what is newly doubted of a sensor, of whose newest samples these are the faults.
pub(super) fn log_doubts(stream: &mut SensorStream, plan: &EstimationSettings, faults: &[Fault]) {
    let lines = stream.doubted(plan);
    let id = stream.id();
    for line in lines {
        log_throttle::warn(
            &format!("doubt {id} {}", line.cause),
            &format!("{id}: {}", line.text),
        );
    }
    let of_clock = [Fault::STAMP_UNIT, Fault::STILL_STAMPS];
    for fault in faults.iter().filter(|f| of_clock.contains(&f.code)) {
        log_throttle::warn(
            &format!("{} {id}", fault.code),
            &format!("{id}: {}", fault.message),
        );
    }
}
