//! Columns of SensorLog, an app for iPhones and watches -> which of several is meant, and which way it points. Pure.
//!
//! Apart from the roles because this maker writes each sensor twice, as it is and as iOS mends it, each with its own
//! stamp in the same row: what belongs together is told by the beginning of the names.

use super::candidates::Group;
use super::roles::Roles;
use crate::columns::Kind;
use crate::columns::Unit;

/// Beginnings of the names of what iOS mends: the rate without its bias, the field without that of the phone.
const MENDED: &str = "motion";
/// End of the names of stamps.
const STAMP: &str = "timestamp_sincereboot";
/// Beginnings of names that no other maker has.
const OWN: [&str; 6] = [
    "loggingtime(",
    "motiontimestamp_since",
    "gyrotimestamp_since",
    "accelerometertimestamp_since",
    "motionrotationratex(",
    "accelerometeraccelerationx(",
];
/// Names of the accelerometer.
const FORCE: &str = "accelerometeracceleration";

impl Roles<'_> {
    fn begins(&self, at: usize, with: &str) -> bool {
        let name = self.names.get(at);
        name.is_some_and(|name| name.text.to_lowercase().starts_with(with))
    }

    /// The stamp of the sensor whose names begin so.
    fn stamp_of(&self, sensor: &str) -> Option<usize> {
        let name = format!("{sensor}{STAMP}");
        (0..self.names.len()).find(|at| self.begins(*at, &name) && !self.is_empty(*at))
    }

    fn is_sensor_log(&self) -> bool {
        let columns = 0..self.names.len();
        OWN.iter()
            .any(|own| columns.clone().any(|at| self.begins(at, own)))
    }

    /// Leaves, of several that may be meant, what iOS mends: a field only if it has one (it needs a compass for it).
    pub(super) fn keep_mended(&self, kind: Kind, groups: &mut Vec<Group>) {
        if groups.len() < 2 || !self.is_sensor_log() {
            return;
        }
        let is_mended = |group: &Group| {
            let mut columns = group.columns.iter();
            columns.all(|at| self.begins(*at, MENDED))
        };
        let has_numbers = |group: &Group| {
            let cells = group.columns.iter().flat_map(|at| self.numbers(*at));
            let mut numbers = cells.filter_map(|cell| cell.parse::<f64>().ok());
            numbers.any(|number| number != 0.0)
        };
        let is_better =
            |group: &Group| is_mended(group) && (kind == Kind::Gyro || has_numbers(group));
        let wanted = groups.iter().any(is_better);
        groups.retain(|group| is_mended(group) == wanted);
    }

    /// The stamp of the rates in these columns.
    pub(super) fn stamp_beside(&self) -> Option<usize> {
        if !self.is_sensor_log() {
            return None;
        }
        let gyro = self.chosen(Kind::Gyro, &mut Vec::new()).ok().flatten();
        let first = gyro.and_then(|gyro| gyro.columns.first().copied());
        let is_mended = first.is_none_or(|at| self.begins(at, MENDED));
        let order = if is_mended {
            ["motion", "gyro"]
        } else {
            ["gyro", "motion"]
        };
        order.into_iter().find_map(|sensor| self.stamp_of(sensor))
    }

    /// The unit of a specific force: iOS reads -1 g on the axis that points up.
    pub(super) fn upward(&self, kind: Kind, columns: &[usize], unit: Unit) -> Unit {
        match unit {
            Unit::Force(base, scale)
                if kind == Kind::Accel
                    && self.is_sensor_log()
                    && columns.iter().all(|at| self.begins(*at, FORCE)) =>
            {
                Unit::Force(base, -scale)
            }
            unit => unit,
        }
    }
}
