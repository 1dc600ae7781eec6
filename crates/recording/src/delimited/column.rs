//! Meaning of a column of a table, and lines that are no rows.

/// Meaning of a column.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Column {
    Stamp,
    /// The day of a stamp that is a time of day.
    Date,
    Log,
    Interval,
    Kind,
    Id,
    Gyro(usize),
    Accel(usize),
    Mag(usize),
    Orientation(usize),
    /// Element of a rotation matrix, by rows.
    Matrix(usize),
    /// Element of the rotation since the sample before.
    Turn(usize),
    Temperature,
}

/// Whether a line is a comment.
pub(super) fn is_comment(row: &[u8]) -> bool {
    row.starts_with(b"#") || row.starts_with(b"//") || row.starts_with(b"%")
}
