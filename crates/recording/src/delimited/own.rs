//! The columns that strapd writes itself. Pure.

use super::column::Column;

/// Whether a column of this name is read.
#[cfg(feature = "parquet")]
pub(crate) fn is_own_column(name: &str) -> bool {
    COLUMNS.iter().any(|(known, _)| *known == name)
}

/// Columns that are read, by name. Those of a rate behind an attitude, and a quaternion's without their `q`, are in
/// tables of attitudes. Units and axes are those of `strapd cat`: rad/s (delta angles in rad), m/s^2, x forward, y
/// left, z up.
pub(super) const COLUMNS: [(&str, Column); 27] = [
    ("stamp_ns", Column::Stamp),
    ("log_ns", Column::Log),
    // Of a synthetic gyro.
    ("true_ns", Column::Log),
    ("interval_ns", Column::Interval),
    ("sample_kind", Column::Kind),
    ("id", Column::Id),
    ("gyro_x", Column::Gyro(0)),
    ("gyro_y", Column::Gyro(1)),
    ("gyro_z", Column::Gyro(2)),
    ("wx", Column::Gyro(0)),
    ("wy", Column::Gyro(1)),
    ("wz", Column::Gyro(2)),
    ("accel_x", Column::Accel(0)),
    ("accel_y", Column::Accel(1)),
    ("accel_z", Column::Accel(2)),
    ("mag_x", Column::Mag(0)),
    ("mag_y", Column::Mag(1)),
    ("mag_z", Column::Mag(2)),
    ("qw", Column::Orientation(0)),
    ("qx", Column::Orientation(1)),
    ("qy", Column::Orientation(2)),
    ("qz", Column::Orientation(3)),
    ("temperature_c", Column::Temperature),
    // As they were called at first.
    ("w", Column::Orientation(0)),
    ("x", Column::Orientation(1)),
    ("y", Column::Orientation(2)),
    ("z", Column::Orientation(3)),
];
