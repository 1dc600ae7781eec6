//! What a column of a table holds, and which lines are no rows.

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Column {
    Stamp,
    Log,
    Interval,
    Kind,
    Id,
    Gyro(usize),
    Accel(usize),
    Mag(usize),
    Orientation(usize),
    /// Of a rotation matrix, by rows.
    Matrix(usize),
    /// Of the rotation since the sample before.
    Turn(usize),
}

/// Whether a line is a comment.
pub(super) fn is_comment(row: &[u8]) -> bool {
    row.starts_with(b"#") || row.starts_with(b"//") || row.starts_with(b"%")
}
