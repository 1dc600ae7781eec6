//! Prints the tables of `docs/accuracy.md`: `cargo run --release --example accuracy_tables`.
//!
//! Truth is exact (the closed-form coning, the top by Taylor series in double-double), rates and delta
//! angles are exact: what is left is the integrator's own error.

use strapd::model::motion::{Coning, Motion};
use strapd::model::top::{Case, SymmetricTop};
use strapd::propagate::{Method, Order, Placement, Propagator, Sequential, Settings};
use strapd::record::{Join, Nanos, RateSample, SampleKind, Status};

type Failure = Box<dyn std::error::Error>;

const METHODS: [(&str, Method); 14] = [
    (
        "dcm-left: w(t_i) (first order, as most peers)",
        Method::DcmLeft,
    ),
    (
        "dcm-right: w(t_i+1) (the seed's rule on gyro data)",
        Method::DcmRight,
    ),
    ("dcm-mean", Method::DcmMean),
    ("rk4, rate linear over the step", Method::Rk4),
    ("causal 3, order 6", magnus(3, Order::M6, Placement::Causal)),
    (
        "causal 5, order 6 (`--method causal`)",
        magnus(5, Order::M6, Placement::Causal),
    ),
    ("commit 6, order 8 (live, zero latency)", commit(6)),
    ("commit 8, order 8", commit(8)),
    (
        "centred 2, order 4 (pyins, PX4 in kind)",
        magnus(2, Order::M4, Placement::Centred),
    ),
    (
        "centred 4, order 8",
        magnus(4, Order::M8, Placement::Centred),
    ),
    (
        "centred 6, order 8",
        magnus(6, Order::M8, Placement::Centred),
    ),
    (
        "centred 8, order 8",
        magnus(8, Order::M8, Placement::Centred),
    ),
    (
        "centred 10, order 8",
        magnus(10, Order::M8, Placement::Centred),
    ),
    ("**auto**: centred 16 (15 increments), exact", Method::Auto),
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

fn main() -> Result<(), Failure> {
    let top = SymmetricTop::seed();
    let start = Case::Cusped.start(&top, Case::SEED_TILT, Case::SEED_W3)?;
    say("### Spinning top, worst error of the attitude over 1.2 s, degrees\n");
    for kind in [SampleKind::Rate, SampleKind::DeltaAngle] {
        say(&format!(
            "Samples: {}.\n\n| method | 500 Hz | 1000 Hz | 2000 Hz | 4000 Hz |",
            kind.name()
        ));
        say("|---|---|---|---|---|");
        // Of a delta angle the classical methods see only the neighbour, or nothing at all.
        let methods = METHODS
            .iter()
            .skip(if kind == SampleKind::Rate { 0 } else { 4 });
        for (name, method) in methods {
            let mut row = format!("| {name} |");
            for hz in [500, 1000, 2000, 4000] {
                let mut motion = Motion::HeavyBody(Box::new(top.exact(&start)?));
                let error = worst(&mut motion, *method, kind, hz, 1_200_000_000, 0)?;
                row.push_str(&format!(" {:.1e} |", error.to_degrees()));
            }
            say(&row);
        }
        say("");
    }
    say(
        "### Coning, half angle 10 degrees, sampled at 100 Hz, 60 s: worst error away from the ends, arcsec\n",
    );
    say("| method | 0.1 Hz | 1 Hz | 3 Hz | 10 Hz |");
    say("|---|---|---|---|---|");
    for (name, method) in METHODS {
        let mut row = format!("| {name} |");
        for hz in [0.1, 1.0, 3.0, 10.0] {
            let mut motion = Motion::Coning(Coning::new(10f64.to_radians(), hz)?);
            let error = worst(
                &mut motion,
                method,
                SampleKind::Rate,
                100,
                60_000_000_000,
                24,
            )?;
            row.push_str(&format!(" {:.1e} |", error.to_degrees() * 3600.0));
        }
        say(&row);
    }
    Ok(())
}

/// Largest angle between estimate and truth in rad, `margin` samples at each end left out: there the
/// error is taken relative to the attitude at the first sample inside.
fn worst(
    motion: &mut Motion,
    method: Method,
    kind: SampleKind,
    rate_hz: u64,
    length_nanos: u64,
    margin: usize,
) -> Result<f64, Failure> {
    let step = 1_000_000_000 / rate_hz;
    let count = length_nanos / step;
    let mut samples = Vec::new();
    let mut truth = Vec::new();
    for i in 0..=count {
        let now = i * step;
        let spin = motion.at_nanos(now);
        truth.push(spin.q_nb);
        let before = now.saturating_sub(step);
        let (value, start) = match kind {
            SampleKind::Rate => (spin.w_nb_b, now),
            SampleKind::Average | SampleKind::DeltaAngle => {
                (motion.delta_angle(before, now), before)
            }
        };
        samples.push(RateSample {
            stamp: Nanos(now as i64),
            start: Nanos(start as i64),
            value,
            accel: None,
            join: if i == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: Nanos(now as i64),
        });
    }
    let initial = truth.first().ok_or("no samples")?;
    let mut propagator = Propagator::new(Settings {
        method,
        kind,
        initial: *initial,
        ..Settings::default()
    })?;
    let mut out = Vec::new();
    propagator.push(&samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    let inside = margin..out.len().saturating_sub(margin);
    let (Some(first_out), Some(first_truth)) = (out.get(margin), truth.get(margin)) else {
        return Err("too few samples".into());
    };
    Ok(out
        .iter()
        .zip(&truth)
        .take(inside.end)
        .skip(inside.start)
        .map(|(sample, truth)| {
            let expected = match margin {
                0 => *truth,
                _ => first_out.q_nb * first_truth.inverse() * *truth,
            };
            expected.angle_to(&sample.q_nb)
        })
        .fold(0.0, f64::max))
}

#[allow(clippy::print_stdout)]
fn say(line: &str) {
    println!("{line}");
}
