//! Increments one by one -> angles at even intervals, in bounded memory. Pure.

use nalgebra::Vector3;

/// Angles of three axes in unbroken pieces. Beyond its capacity every second angle is dropped, and
/// the interval doubles: long clusters lose nothing, the shortest go.
#[derive(Clone, Debug)]
pub struct AngleRecord {
    capacity: usize,
    /// Sampling intervals between two angles kept.
    stride: usize,
    angles: [Vec<f64>; 3],
    /// First index of each piece.
    begins: Vec<usize>,
    /// Subtracted from every increment: an Allan deviation does not see it, rounding does.
    level: Option<Vector3<f64>>,
    angle: Vector3<f64>,
    /// Increments since the piece began.
    taken: usize,
    /// Increments in all.
    count: u64,
    lowest: Vector3<f64>,
    highest: Vector3<f64>,
}

impl AngleRecord {
    /// Makes one for at most `capacity` angles (at least 64), 24 bytes each.
    #[must_use]
    pub fn new(capacity: usize) -> AngleRecord {
        AngleRecord {
            capacity: capacity.max(64),
            stride: 1,
            angles: [Vec::new(), Vec::new(), Vec::new()],
            begins: Vec::new(),
            level: None,
            angle: Vector3::zeros(),
            taken: 0,
            count: 0,
            lowest: Vector3::repeat(f64::INFINITY),
            highest: Vector3::repeat(f64::NEG_INFINITY),
        }
    }

    /// The next increment: the angle turned over one sampling interval, rad (or, as long as all are, the
    /// rate: angles are then in units of the interval).
    pub fn push(&mut self, increment: &Vector3<f64>) {
        let level = *self.level.get_or_insert(*increment);
        self.lowest = self.lowest.inf(increment);
        self.highest = self.highest.sup(increment);
        if self.begins.is_empty() {
            self.split();
        }
        self.count += 1;
        self.taken += 1;
        self.angle += increment - level;
        if self.taken.is_multiple_of(self.stride) {
            self.keep();
        }
    }

    /// A gap: what follows does not continue what came before.
    pub fn split(&mut self) {
        // A piece of nothing but its beginning says nothing.
        let end = self.len();
        if let Some(begin) = self.begins.pop_if(|b| *b + 1 >= end) {
            self.angles.iter_mut().for_each(|a| a.truncate(begin));
        }
        self.begins.push(self.len());
        self.angle = Vector3::zeros();
        self.taken = 0;
        self.keep();
    }

    /// Angles kept.
    fn len(&self) -> usize {
        self.angles[0].len()
    }

    fn keep(&mut self) {
        for (kept, angle) in self.angles.iter_mut().zip(self.angle.iter()) {
            kept.push(*angle);
        }
        if self.len() >= self.capacity {
            self.thin();
        }
    }

    /// Drops every second angle of every piece, and pieces of which one angle is left, but for the
    /// last, which goes on.
    fn thin(&mut self) {
        let ends: Vec<usize> = self.begins.iter().skip(1).copied().collect();
        let mut to = 0;
        let mut begins = Vec::with_capacity(self.begins.len());
        let last = self.len();
        for (begin, end) in self.begins.iter().zip(ends.into_iter().chain([last])) {
            if end < last && end - begin <= 2 {
                continue;
            }
            begins.push(to);
            for from in (*begin..end).step_by(2) {
                for kept in &mut self.angles {
                    kept[to] = kept[from];
                }
                to += 1;
            }
        }
        self.angles.iter_mut().for_each(|a| a.truncate(to));
        self.begins = begins;
        self.stride *= 2;
    }

    /// Sampling intervals between two angles: 1 until the record was longer than its capacity.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Increments taken.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Largest less smallest increment of each axis; zero = the axis is stuck.
    #[must_use]
    pub fn spread(&self) -> Vector3<f64> {
        (self.highest - self.lowest).map(|v| v.max(0.0))
    }

    /// The unbroken pieces of one axis (0 to 2).
    #[must_use]
    pub fn pieces(&self, axis: usize) -> Vec<&[f64]> {
        let Some(angles) = self.angles.get(axis) else {
            return Vec::new();
        };
        let ends = self.begins.iter().skip(1).copied().chain([angles.len()]);
        self.begins
            .iter()
            .zip(ends)
            .filter_map(|(begin, end)| angles.get(*begin..end))
            .collect()
    }
}
