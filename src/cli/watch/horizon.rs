//! An attitude -> a small picture of the horizon, as characters. Pure.
//!
//! What a camera would see that looks along the body's x axis: each cell is sky or ground by the
//! side of the horizontal plane its line of sight points to, so that it is right at any attitude,
//! upside down too.

/// Tangent of half the angle the picture is wide.
const HALF_WIDTH: f64 = 1.0;
/// Ratio of height to width of a character.
const TALL: f64 = 2.0;

/// Up in body axes as (forward, right, up). `q` is `[w, x, y, z]`, body to world.
fn up([w, x, y, z]: [f64; 4], world: &str, body: &str) -> [f64; 3] {
    let is_frd = body == "frd";
    // The start's axes are those of the body then; it is taken to have been upright.
    let points_down = world == "ned" || (world == "start" && is_frd);
    let sign = if points_down { -1.0 } else { 1.0 };
    let in_body = [
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    ]
    .map(|v| sign * v);
    let [forward, second, third] = in_body;
    match is_frd {
        true => [forward, second, -third],
        false => [forward, -second, third],
    }
}

/// `rows` lines of `columns` characters: blank is sky, `:` is ground. Blank when `q` is none.
pub(super) fn horizon(
    q: [f64; 4],
    world: &str,
    body: &str,
    columns: usize,
    rows: usize,
) -> Vec<String> {
    if q.iter().any(|v| !v.is_finite()) {
        return vec![" ".repeat(columns); rows];
    }
    let [f, r, u] = up(q, world, body);
    let cell = 2.0 * HALF_WIDTH / columns as f64;
    let (middle_column, middle_row) = (columns as f64 / 2.0, rows as f64 / 2.0);
    let height = |column: f64, row: f64| {
        f + r * (column - middle_column) * cell + u * (middle_row - row) * cell * TALL
    };
    // The slope of the horizon as it is drawn, cells up for a cell to the right.
    let slope = -r / (u * TALL);
    let mut lines = Vec::with_capacity(rows);
    for row in 0..rows {
        let mut line = String::with_capacity(columns);
        for column in 0..columns {
            let (left, top) = (column as f64, row as f64);
            let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
                .map(|(x, y)| height(left + x, top + y) >= 0.0);
            let mark = if corners == [true; 4] {
                ' '
            } else if corners == [false; 4] {
                ':'
            } else if slope.abs() > 2.0 || !slope.is_finite() {
                '|'
            } else if slope > 0.4 {
                '/'
            } else if slope < -0.4 {
                '\\'
            } else {
                // Above or below the middle of the cell.
                let sky_above = (height(left + 0.5, top + 0.5) >= 0.0) == (u >= 0.0);
                if sky_above { '_' } else { '-' }
            };
            let from_middle = column as i64 - (columns / 2) as i64;
            line.push(match (row == rows / 2, from_middle) {
                (true, 0) => '+',
                (true, -4 | -3 | 3 | 4) => '=',
                _ => mark,
            });
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(axis: [f64; 3], degrees: f64) -> [f64; 4] {
        let half = degrees.to_radians() / 2.0;
        let [x, y, z] = axis.map(|a| a * half.sin());
        [half.cos(), x, y, z]
    }

    const X: [f64; 3] = [1.0, 0.0, 0.0];
    const Y: [f64; 3] = [0.0, 1.0, 0.0];
    const Z: [f64; 3] = [0.0, 0.0, 1.0];

    /// Share of each quarter that is ground: upper left, upper right, lower left, lower right.
    fn ground(q: [f64; 4], world: &str, body: &str) -> [usize; 4] {
        let lines = horizon(q, world, body, 21, 9);
        assert_eq!(lines.len(), 9);
        let count = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| {
            lines[rows]
                .iter()
                .map(|l| l[columns.clone()].matches(':').count())
                .sum()
        };
        [
            count(0..4, 0..10),
            count(0..4, 11..21),
            count(5..9, 0..10),
            count(5..9, 11..21),
        ]
    }

    #[test]
    fn level_is_sky_above_and_ground_below_whichever_way_it_heads() {
        for yaw in [0.0, 90.0, -170.0] {
            for (world, body) in [
                ("enu", "flu"),
                ("start", "flu"),
                ("ned", "frd"),
                ("start", "frd"),
            ] {
                let q = turned(Z, yaw);
                assert_eq!(ground(q, world, body), [0, 0, 40, 40], "{world} {body}");
            }
        }
    }

    #[test]
    fn nose_up_shows_sky_and_nose_down_ground_in_either_convention() {
        // y points left in FLU, so nose up is a negative turn; right in FRD, a positive one.
        assert_eq!(ground(turned(Y, -50.0), "enu", "flu"), [0; 4]);
        assert_eq!(ground(turned(Y, 50.0), "ned", "frd"), [0; 4]);
        assert_eq!(ground(turned(Y, 50.0), "enu", "flu"), [40; 4]);
        assert_eq!(ground(turned(Y, -50.0), "ned", "frd"), [40; 4]);
    }

    #[test]
    fn with_the_right_side_down_the_ground_rises_on_the_right() {
        for (world, body) in [("enu", "flu"), ("ned", "frd")] {
            let [upper_left, upper_right, lower_left, lower_right] =
                ground(turned(X, 45.0), world, body);
            assert!(upper_right > upper_left, "{world} {body}");
            assert!(lower_right > lower_left, "{world} {body}");
        }
    }

    #[test]
    fn upside_down_the_ground_is_above() {
        assert_eq!(ground(turned(X, 180.0), "enu", "flu"), [40, 40, 0, 0]);
    }

    #[test]
    fn what_is_no_attitude_is_no_picture() {
        let lines = horizon([f64::NAN; 4], "enu", "flu", 5, 2);
        assert_eq!(lines, ["     ", "     "]);
    }
}
