//! Cases that are timed and counted: methods and logs.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::hint::black_box;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::propagate::{
    Method, Noise, Order, Placement, Propagator, Sequential, Settings, SettingsError,
};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{
    AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status,
};

/// A log, as its samples are made.
#[derive(Clone, Copy)]
pub struct Input {
    pub kind: SampleKind,
    /// White noise, rad/s, rms.
    noise: f64,
    /// Whether sampling instants are off by up to a tenth of the interval.
    jitter: bool,
}

/// Every input, and its name.
pub const INPUTS: [(&str, Input); 5] = [
    (
        "smooth",
        Input {
            kind: SampleKind::Rate,
            noise: 0.0,
            jitter: false,
        },
    ),
    (
        "rates",
        Input {
            kind: SampleKind::Rate,
            noise: 5e-3,
            jitter: false,
        },
    ),
    (
        "jittered",
        Input {
            kind: SampleKind::Rate,
            noise: 5e-3,
            jitter: true,
        },
    ),
    (
        "increments",
        Input {
            kind: SampleKind::DeltaAngle,
            noise: 5e-3,
            jitter: false,
        },
    ),
    (
        "increments-jittered",
        Input {
            kind: SampleKind::DeltaAngle,
            noise: 5e-3,
            jitter: true,
        },
    ),
];

const fn magnus(window: usize, order: Order, placement: Placement) -> Method {
    Method::Magnus {
        window,
        order,
        placement,
    }
}

const fn commit(window: usize) -> Method {
    Method::CommitProvisional {
        window,
        order: Order::M8,
        finals: false,
    }
}

/// Every method of the enum, with the windows the documents speak of. First what costs are held against: one
/// exponential and one product a sample and nothing else, no stream, no checks, no uncertainty.
pub const METHODS: [(&str, Option<Method>); 19] = [
    ("bare exponential", None),
    ("dcm-right", Some(Method::DcmRight)),
    ("dcm-left", Some(Method::DcmLeft)),
    ("dcm-mean", Some(Method::DcmMean)),
    ("rotvec-sum", Some(Method::RotvecSum)),
    ("coning2", Some(Method::Coning2)),
    ("coning3", Some(Method::Coning3)),
    ("coning4", Some(Method::Coning4)),
    ("rk4", Some(Method::Rk4)),
    ("causal3-6", Some(magnus(3, Order::M6, Placement::Causal))),
    ("causal5-6", Some(magnus(5, Order::M6, Placement::Causal))),
    ("centred6-8", Some(magnus(6, Order::M8, Placement::Centred))),
    ("centred8-8", Some(magnus(8, Order::M8, Placement::Centred))),
    (
        "centred16-8",
        Some(magnus(16, Order::M8, Placement::Centred)),
    ),
    (
        "centred16-exact",
        Some(magnus(16, Order::Exact, Placement::Centred)),
    ),
    ("auto", Some(Method::Auto)),
    ("commit5", Some(commit(5))),
    ("commit6", Some(commit(6))),
    ("commit8", Some(commit(8))),
];

/// 200 Hz, 2 rad/s, a few Hz.
pub fn log(count: usize, input: &Input) -> Vec<RateSample> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut before = 0;
    (0..count)
        .map(|i| {
            let mut stamp = i as i64 * 5_000_000;
            if input.jitter {
                stamp += rng.random_range(-500_000..500_000);
            }
            let t = stamp as f64 * 1e-9;
            let mut axis = |f: f64, phase: f64| {
                (f * t * std::f64::consts::TAU + phase).sin() * 2.0
                    + input.noise * rng.random_range(-1.7..1.7)
            };
            let mut value = [axis(2.3, 0.0), axis(3.1, 1.0), axis(4.7, 2.0)];
            let start = if i == 0 { stamp - 5_000_000 } else { before };
            if input.kind != SampleKind::Rate {
                value = value.map(|v| v * (stamp - start) as f64 * 1e-9);
            }
            before = stamp;
            RateSample {
                stamp: Nanos(stamp),
                start: Nanos(if input.kind == SampleKind::Rate {
                    stamp
                } else {
                    start
                }),
                gyro: Measured::assume(input.kind, value.into()),
                accel: None,
                join: if i == 0 {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: Nanos(stamp),
            }
        })
        .collect()
}

/// Samples in, attitudes out, as a file's reader pushes them.
pub fn run(
    method: Option<Method>,
    kind: SampleKind,
    samples: &[RateSample],
    out: &mut Vec<AttitudeSample>,
) -> Result<(), SettingsError> {
    let Some(method) = method else {
        bare(samples);
        return Ok(());
    };
    let noise = Noise {
        arw: [2.4e-4; 3],
        bias: [1e-3; 3],
        ..Noise::default()
    };
    let mut propagator = Propagator::new(Settings {
        method,
        kind,
        initial: Quaternion::identity(),
        noise,
        ..Settings::default()
    })?;
    out.clear();
    for chunk in samples.chunks(8192) {
        propagator.push(chunk, &Sequential, out);
    }
    propagator.finish(&Sequential, out);
    Ok(())
}

/// `q exp(w dt)`, written out.
fn bare(samples: &[RateSample]) {
    let mut q_nb = Quaternion::<Nav, Body>::identity();
    let mut before = samples.first().map_or(Nanos(0), |first| first.stamp);
    for sample in samples {
        let h = sample.stamp.secs_since(before);
        before = sample.stamp;
        let angle = match sample.gyro {
            Measured::Rate(rate) => rate.held_for(h),
            Measured::Increment(angle) => angle,
        };
        q_nb = black_box(q_nb.advanced(&angle.about_fixed_axis()));
    }
}
