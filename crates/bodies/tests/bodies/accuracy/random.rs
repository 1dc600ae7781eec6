//! Random band-limited motion, 200 Hz, 2 rad/s rms per axis, 60 s, of `docs/theory/attitude.md` 6.3: equal spacings (U),
//! true sampling jitter (J), and jitter with lost samples (D). Truth by power series (`strapd_bodies::motion`).

use super::run::{ARCSEC, propagate, sample, worst_inside};
use super::{centred, commit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use strapd_attitude::propagate::{Method, Order};
use strapd_attitude::record::{Join, RateSample, SampleKind};
use strapd_bodies::motion::BandLimited;

const STEP: f64 = 5e6;
const COUNT: usize = 12_000;
const SINES: usize = 40;

pub struct Log {
    pub rates: Vec<RateSample>,
    pub increments: Vec<RateSample>,
    pub truth: Vec<[f64; 4]>,
}

/// The whole motion; highest frequency as a part of the sampling rate, jitter as a part of the interval.
pub fn recorded(seed: u64, part_of_rate: f64, jitter: f64) -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut motion = BandLimited::random(seed, 2.0, part_of_rate * 1e9 / STEP, SINES).unwrap();
    let mut log = Log {
        rates: vec![],
        increments: vec![],
        truth: vec![],
    };
    let mut before = 0;
    for k in 0..COUNT {
        let place = (k + 1) as f64 + jitter * rng.random_range(-1.0..1.0);
        let stamp = (STEP * place) as i64;
        let spin = motion.at_nanos(stamp as u64);
        let increment = motion.delta_angle(before as u64, stamp as u64);
        let start = if k == 0 { stamp } else { before };
        log.rates.push(sample(stamp, stamp, spin.w_nb_b.into()));
        log.increments.push(sample(start, stamp, increment.into()));
        log.truth.push(spin.q_nb.wxyz());
        before = stamp;
    }
    log
}

impl Log {
    /// One in a hundred lost, two in a row or not; what comes after a loss says so, or does not.
    fn with_losses(&self, seed: u64, in_a_row: bool, join: Join) -> Log {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x10_55);
        let mut lost = false;
        let kept: Vec<usize> = (0..self.truth.len())
            .filter(|&k| {
                lost = rng.random_range(0.0..1.0) < 0.01 && k > 40 && (in_a_row || !lost);
                !lost
            })
            .collect();
        let of = |samples: &[RateSample]| {
            let mut before = 0;
            kept.iter()
                .map(|&k| {
                    let mut sample = samples[k];
                    if k > before + 1 {
                        sample.join = join;
                    }
                    before = k;
                    sample
                })
                .collect()
        };
        Log {
            rates: of(&self.rates),
            increments: of(&self.increments),
            truth: kept.iter().map(|&k| self.truth[k]).collect(),
        }
    }
}

fn error(log: &Log, kind: SampleKind, method: Method) -> f64 {
    let samples = match kind {
        SampleKind::Rate => &log.rates,
        _ => &log.increments,
    };
    let out = propagate(method, kind, log.truth[0], samples);
    worst_inside(&out, |i| log.truth[i], 24) * ARCSEC
}

/// The table's rows: greatest error in arc seconds with highest frequencies of .02, .05, .1, .2 of the sampling
/// rate (U), .05, .1 (J) and .05, .1 (D). NaN: no figure, or one of the table's own rounding.
const TABLE: [(SampleKind, Method, [f64; 8]); 11] = {
    const RATE: SampleKind = SampleKind::Rate;
    const DELTA: SampleKind = SampleKind::DeltaAngle;
    const NONE: f64 = f64::NAN;
    const M8: Order = Order::M8;
    [
        (
            RATE,
            commit(6),
            [1.8e-3, 0.15, 2.8, 120.0, 0.21, 8.9, 1.0, 56.0],
        ),
        (
            RATE,
            commit(8),
            [5.7e-6, 0.0031, 0.62, 110.0, 0.0055, 1.7, 0.07, 16.0],
        ),
        (
            RATE,
            centred(8, M8),
            [5.5e-6, 0.0025, 0.14, 14.0, 0.0032, 0.73, 0.019, 3.7],
        ),
        (
            RATE,
            centred(12, M8),
            [NONE, 8.9e-7, 8.2e-4, 1.0, 1.2e-6, 4.9e-3, 1.2e-5, 0.041],
        ),
        (
            RATE,
            centred(16, M8),
            [NONE, 5.1e-8, 5.3e-6, 0.08, 1.2e-7, 3.2e-5, 7.3e-7, 4.1e-4],
        ),
        (
            RATE,
            Method::Auto,
            [NONE, 5.1e-8, 5.3e-6, 0.08, 1.2e-7, 3.2e-5, 7.3e-7, 4.1e-4],
        ),
        (
            DELTA,
            commit(5),
            [NONE, 0.13, 1.4, 27.0, 0.14, 1.5, 9.3, 230.0],
        ),
        (
            DELTA,
            commit(7),
            [NONE, 0.0023, 0.11, 7.2, 0.0025, 0.12, 0.21, 21.0],
        ),
        (
            DELTA,
            centred(5, M8),
            [NONE, 0.13, 1.4, 27.0, 0.14, 1.5, 8.7, 210.0],
        ),
        (
            DELTA,
            centred(7, M8),
            [NONE, 0.0023, 0.10, 7.0, 0.0024, 0.11, 0.2, 17.0],
        ),
        (
            DELTA,
            centred(9, M8),
            [NONE, 5.8e-5, 0.0079, 1.9, 7.5e-5, 0.0088, 0.0046, 1.5],
        ),
    ]
};

/// Errors of three seeds over the table's figure, sorted, row by row of one column.
fn ratios(logs: &[Log; 3], column: usize, mut judge: impl FnMut(&str, [f64; 3])) {
    for (kind, method, row) in TABLE.into_iter().filter(|row| !row.2[column].is_nan()) {
        let mut found = logs
            .each_ref()
            .map(|log| error(log, kind, method) / row[column]);
        found.sort_by(f64::total_cmp);
        eprintln!("column {column}: {method}, {}: {found:.3?}", kind.name());
        judge(
            &format!("column {column}, {method}, {}", kind.name()),
            found,
        );
    }
}

const SEEDS: [u64; 3] = [1, 2, 3];

fn each_within_twice_the_table(logs: &[Log; 3], column: usize) {
    ratios(logs, column, |row, found| {
        assert!(found[2] < 2.0, "{row}: {found:.2?} of the table");
    });
}

#[test]
fn equal_spacings_cost_what_the_table_says_on_random_motion() {
    for (column, part) in [(1, 0.05), (2, 0.1)] {
        each_within_twice_the_table(&SEEDS.map(|seed| recorded(seed, part, 0.0)), column);
    }
}

#[test]
#[ignore = "two more columns of the same table, 8 s"]
fn the_slowest_and_the_fastest_random_motion_cost_what_the_table_says() {
    for (column, part) in [(0, 0.02), (3, 0.2)] {
        each_within_twice_the_table(&SEEDS.map(|seed| recorded(seed, part, 0.0)), column);
    }
}

/// Jittered (column), with losses one by one and with losses as they fall (column + 2).
fn jitter_and_losses(column: usize, part: f64) {
    let jittered = SEEDS.map(|seed| recorded(seed, part, 0.2));
    each_within_twice_the_table(&jittered, column);
    let lossy = |in_a_row, join| {
        let mut seeds = SEEDS.into_iter();
        jittered
            .each_ref()
            .map(|log| log.with_losses(seeds.next().unwrap(), in_a_row, join))
    };
    // Every seed, while losses come one by one. Marked as the conditioner marks them: that costs nothing.
    each_within_twice_the_table(&lossy(false, Join::Bridge), column + 2);
    // Twelve thousand samples lose two in a row about once. Across that gap the error is some three times
    // that of one lost, and a greatest error is what it is there: the table is of one draw, so the median.
    ratios(&lossy(true, Join::Continuous), column + 2, |row, found| {
        assert!(found[1] < 2.0, "{row}: {found:.2?} of the table");
    });
}

#[test]
fn jitter_and_losses_cost_what_the_table_says_at_a_twentieth_of_the_rate() {
    jitter_and_losses(4, 0.05);
}

#[test]
fn jitter_and_losses_cost_what_the_table_says_at_a_tenth_of_the_rate() {
    jitter_and_losses(5, 0.1);
}
