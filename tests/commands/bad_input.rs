//! Promise: whatever is wrong with the samples or the settings, every method and every kind of sample
//! answers with a clear error or a counted verdict, and never with NaN.
//!
//! One table of cases through conditioning and propagation; `properties.rs` has what holds for any
//! stream, `condition.rs` each rule by itself, `replay.rs` the same in files.

mod files;

use strapd_attitude::condition::{self, Conditioner, OnGap};
use strapd_attitude::estimate::settings;
use strapd_attitude::propagate::{
    self, LARGEST_WINDOW, Method, Order, Placement, Propagator, Sequential, Settings,
};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample, SampleKind, Status, Verdict};

const KINDS: [SampleKind; 3] = [
    SampleKind::Rate,
    SampleKind::Average,
    SampleKind::DeltaAngle,
];
const START: i64 = 1_700_000_000_000_000_000;
const STEP: i64 = 10_000_000;
const SECS: f64 = 0.01;
/// A fixed axis: every method is exact, but for the one that sums rotation vectors from a large one.
const RATE: [f64; 3] = [0.4, -1.1, 0.7];
const INITIAL: [f64; 4] = [0.5, -0.5, 0.5, 0.5];

/// Names of all methods.
fn method_names() -> impl Iterator<Item = &'static str> {
    let row = settings::row("method").unwrap();
    row.words.iter().map(|word| word.name)
}

fn method_named(name: &str) -> Method {
    let mut plan = settings::defaults();
    let row = settings::row("method").unwrap();
    row.apply(&mut plan, &settings::Value::Text(name)).unwrap();
    plan.method
}

/// Every method by name, and windows at both ends of their range.
fn methods() -> Vec<Method> {
    let mut all: Vec<Method> = method_names().map(method_named).collect();
    assert!(all.len() > 10);
    for window in [2, 3, LARGEST_WINDOW] {
        for placement in [Placement::Centred, Placement::Causal] {
            for order in [Order::M2, Order::M8, Order::Exact] {
                all.push(Method::Magnus {
                    window,
                    order,
                    placement,
                });
            }
        }
        all.push(Method::CommitProvisional {
            window,
            order: Order::M6,
            finals: false,
        });
    }
    all
}

fn raw(kind: SampleKind, stamp: i64, rate: [f64; 3]) -> RawSample {
    RawSample {
        header: Some(Nanos(START + stamp)),
        log: Nanos(START + stamp),
        gyro: Some(match kind {
            SampleKind::DeltaAngle | SampleKind::Rotation => rate.map(|w| w * SECS),
            _ => rate,
        }),
        ..RawSample::default()
    }
}

fn even(kind: SampleKind, n: i64) -> Vec<RawSample> {
    (0..n).map(|k| raw(kind, k * STEP, RATE)).collect()
}

/// Output of a run.
struct Run {
    conditioning: condition::Report,
    propagation: propagate::Report,
    out: Vec<AttitudeSample>,
}

impl Run {
    fn counted(&self, verdict: Verdict) -> u64 {
        self.conditioning.counts.get(verdict)
    }

    /// Angle from output `i - 1` to output `i`, rad.
    fn turned(&self, i: usize) -> f64 {
        self.out[i - 1].q_nb.angle_to(&self.out[i].q_nb)
    }
}

fn run(method: Method, settings: &condition::Settings, samples: &[RawSample]) -> Run {
    let mut conditioner = Conditioner::new(settings).unwrap();
    let mut propagator = Propagator::new(Settings {
        method,
        kind: settings.kind,
        initial: Quaternion::assume_unit(INITIAL),
        ..Settings::default()
    })
    .unwrap();
    let (mut rates, mut out) = (Vec::new(), Vec::new());
    for part in samples.chunks(7) {
        conditioner.push(part, &mut rates);
        propagator.push(&rates, &Sequential, &mut out);
        rates.clear();
    }
    conditioner.finish(&mut rates);
    propagator.push(&rates, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    Run {
        conditioning: conditioner.report().clone(),
        propagation: propagator.report(),
        out,
    }
}

/// A case: what the samples are, with which settings, and what must be seen.
struct Case {
    name: &'static str,
    settings: fn(&mut condition::Settings),
    samples: fn(SampleKind) -> Vec<RawSample>,
    check: fn(&Run, SampleKind, Method),
}

/// Error allowed of a step about a fixed axis, rad: rounding, and Runge-Kutta's fifth order.
fn own_error(method: Method, angle: f64) -> f64 {
    let own = match method {
        Method::Rk4 => (0.5 * angle).powi(5) / 30.0,
        _ => 0.0,
    };
    1e-14 + own
}

fn as_it_is(_: &mut condition::Settings) {}

/// Samples with a hole of `nanos` before sample 60 of 120, by every clock.
fn holed(kind: SampleKind, nanos: i64) -> Vec<RawSample> {
    let mut samples = set(kind, nanos);
    for s in &mut samples[60..] {
        s.log = Nanos(s.log.0 + nanos);
        s.publish = Nanos(s.publish.0 + nanos);
    }
    samples
}

/// Samples whose own clock was set by `nanos` before sample 60 of 120.
fn set(kind: SampleKind, nanos: i64) -> Vec<RawSample> {
    let mut samples = even(kind, 120);
    for s in &mut samples[60..] {
        s.header = s.header.map(|h| Nanos(h.0 + nanos));
    }
    samples
}

fn same(a: &Quaternion<strapd_attitude::frames::Nav, strapd_attitude::frames::Body>) -> f64 {
    a.angle_to(&Quaternion::assume_unit(INITIAL))
}

const CASES: &[Case] = &[
    Case {
        name: "no sample",
        settings: as_it_is,
        samples: |_| Vec::new(),
        check: |run, _, _| assert!(run.out.is_empty()),
    },
    Case {
        name: "one sample",
        settings: as_it_is,
        samples: |kind| even(kind, 1),
        check: |run, _, _| assert!(same(&run.out[0].q_nb) < 1e-15),
    },
    Case {
        name: "two samples",
        settings: as_it_is,
        samples: |kind| even(kind, 2),
        check: |run, _, method| {
            let expected = SECS * RATE.iter().map(|w| w * w).sum::<f64>().sqrt();
            if method != Method::RotvecSum {
                assert!((run.turned(1) - expected).abs() < own_error(method, expected));
            }
        },
    },
    Case {
        name: "a window larger than the data",
        settings: as_it_is,
        samples: |kind| even(kind, 5),
        check: |run, _, method| {
            let expected = SECS * RATE.iter().map(|w| w * w).sum::<f64>().sqrt();
            let window = match method {
                Method::Auto => 15,
                Method::Magnus { window, .. } | Method::CommitProvisional { window, .. } => window,
                _ => 0,
            };
            for i in 1..5 {
                if method != Method::RotvecSum {
                    assert!(
                        (run.turned(i) - expected).abs() < own_error(method, expected),
                        "{i}"
                    );
                }
            }
            // Fewer samples than asked for are used, and that is counted.
            assert!(window <= 5 || run.propagation.reduced == 4);
        },
    },
    Case {
        name: "the same sample twice",
        settings: as_it_is,
        samples: |kind| {
            let mut samples = even(kind, 60);
            samples.insert(30, samples[30]);
            samples
        },
        check: |run, _, _| {
            assert_eq!(run.counted(Verdict::Repeated), 1);
            assert_eq!(run.out.len(), 60);
        },
    },
    Case {
        name: "two samples on one stamp, within a window",
        settings: as_it_is,
        samples: |kind| {
            let mut samples = even(kind, 60);
            let mut twin = samples[30];
            twin.gyro = twin.gyro.map(|v| v.map(|v| v * 1.5));
            samples.insert(31, twin);
            samples
        },
        check: |run, _, _| {
            // No longer step beside it.
            assert_eq!(run.counted(Verdict::DuplicateStamp), 1);
        },
    },
    Case {
        name: "a whole window on one stamp",
        settings: as_it_is,
        samples: |kind| {
            (0..90)
                .map(|k| {
                    let stamp = if (30..60).contains(&k) { 30 } else { k };
                    let mut rate = RATE;
                    rate[0] += k as f64 * 1e-6;
                    raw(kind, stamp * STEP, rate)
                })
                .collect()
        },
        check: |run, _, _| {
            // The step to sample 60 has room for all thirty.
            assert_eq!(run.counted(Verdict::Restamped), 29);
            assert_eq!(run.out.len(), 90);
        },
    },
    Case {
        name: "a negative step: overtaken",
        settings: as_it_is,
        samples: |kind| {
            let mut samples = even(kind, 60);
            samples.swap(30, 31);
            samples
        },
        check: |run, _, _| {
            assert_eq!(run.counted(Verdict::Reordered), 1);
            assert_eq!(run.out.len(), 60);
        },
    },
    Case {
        name: "a negative step: late",
        settings: as_it_is,
        samples: |kind| {
            let mut samples = even(kind, 120);
            let late = samples.remove(10);
            samples.insert(90, late);
            samples
        },
        check: |run, _, _| {
            assert_eq!(run.counted(Verdict::Late), 1);
            assert_eq!(run.out.len(), 119);
        },
    },
    Case {
        name: "a negative step: a clock set back, and so is the log's",
        settings: as_it_is,
        samples: |kind| holed(kind, -3_600_000_000_000),
        check: |run, _, _| {
            assert_eq!(run.conditioning.gaps.jumps_back, 1);
            assert_eq!(run.out.len(), 120);
            assert!(run.turned(60) < 1e-15 && run.out[60].status.has(Status::HELD));
        },
    },
    Case {
        name: "a clock set back while the log's goes on",
        settings: as_it_is,
        samples: |kind| set(kind, -3_600_000_000_000),
        check: |run, _, _| {
            assert_eq!(run.conditioning.gaps.jumps_back, 0);
            assert_eq!(run.out.len(), 120);
            assert!(
                run.out
                    .iter()
                    .all(|sample| !sample.status.has(Status::HELD))
            );
        },
    },
    Case {
        name: "more than half a turn in a step",
        settings: as_it_is,
        samples: |kind| {
            (0..60)
                .map(|k| raw(kind, k * STEP, [0.0, 0.0, 400.0]))
                .collect()
        },
        check: |run, _, _| {
            assert_eq!(run.propagation.undersampled, 59);
            assert!((run.propagation.largest_step - 4.0).abs() < 1e-9);
            let flagged = run.out[1..]
                .iter()
                .filter(|a| a.status.has(Status::UNDERSAMPLED));
            assert_eq!(flagged.count(), 59);
        },
    },
    Case {
        name: "a gap that may not be bridged, held",
        settings: as_it_is,
        samples: |kind| holed(kind, 2_000_000_000),
        check: |run, _, _| {
            assert_eq!(run.propagation.holds, 1);
            assert_eq!(run.propagation.bridged, 0);
            assert!(run.turned(60) < 1e-15);
            assert!(run.out[60].status.has(Status::HELD));
        },
    },
    Case {
        name: "a gap that may not be bridged, reset",
        settings: |settings| settings.on_gap = OnGap::Reset,
        samples: |kind| holed(kind, 2_000_000_000),
        check: |run, _, _| {
            assert_eq!(run.propagation.resets, 1);
            assert!(same(&run.out[60].q_nb) < 1e-15);
            assert!(run.out[60].status.has(Status::RESET));
        },
    },
    Case {
        name: "no gap may be bridged",
        settings: |settings| settings.max_gap_secs = 0.0,
        samples: |kind| {
            let mut samples = even(kind, 120);
            samples.remove(60);
            samples
        },
        check: |run, _, _| {
            // Ordinary steps are no gaps.
            assert_eq!((run.propagation.holds, run.propagation.bridged), (1, 0));
        },
    },
    Case {
        name: "a gap that may be bridged",
        settings: as_it_is,
        samples: |kind| holed(kind, 300_000_000),
        check: |run, _, method| {
            assert_eq!((run.propagation.holds, run.propagation.bridged), (0, 1));
            assert!(run.out[60].status.has(Status::BRIDGED));
            let expected = 31.0 * SECS * RATE.iter().map(|w| w * w).sum::<f64>().sqrt();
            if method != Method::RotvecSum {
                assert!(
                    (run.turned(60) - expected).abs() < own_error(method, expected),
                    "{}",
                    run.turned(60)
                );
            }
        },
    },
    Case {
        name: "values that are none",
        settings: as_it_is,
        samples: |kind| {
            let mut samples = even(kind, 60);
            let bad = [f64::NAN, f64::INFINITY, -1e300, f64::MAX];
            for (k, bad) in bad.into_iter().enumerate() {
                samples[10 + 10 * k].gyro = Some([0.0, bad, 0.0]);
            }
            samples
        },
        check: |run, _, _| {
            let bad = run.counted(Verdict::NotFinite) + run.counted(Verdict::Huge);
            assert_eq!((bad, run.out.len()), (4, 56));
        },
    },
    Case {
        name: "steps of a nanosecond",
        settings: as_it_is,
        samples: |kind| (0..60).map(|k| raw(kind, k, RATE)).collect(),
        check: |run, _, _| assert_eq!(run.out.len(), 60),
    },
    Case {
        name: "steps of a year",
        settings: as_it_is,
        samples: |kind| {
            (0..60)
                .map(|k| raw(kind, k * 31_557_600_000_000_000, RATE))
                .collect()
        },
        check: |run, _, _| assert!(run.out.len() + run.conditioning.counts.lost() as usize == 60),
    },
];

#[test]
fn every_case_is_counted_for_every_method_and_every_kind_and_nothing_is_nan() {
    for case in CASES {
        for kind in KINDS {
            let samples = (case.samples)(kind);
            for method in methods() {
                let mut settings = condition::Settings {
                    kind,
                    ..condition::Settings::default()
                };
                (case.settings)(&mut settings);
                let run = run(method, &settings, &samples);
                let what = format!("{}, {method}, {kind:?}", case.name);
                let counts = run.conditioning.counts;
                assert_eq!(
                    counts.total(),
                    samples.len() as u64,
                    "{what}: not all counted"
                );
                assert_eq!(run.out.len() as u64, counts.used(), "{what}: not one each");
                for a in &run.out {
                    let norm = a.q_nb.wxyz().iter().map(|c| c * c).sum::<f64>().sqrt();
                    assert!((norm - 1.0).abs() < 1e-12, "{what}: {a:?}");
                    let matrix = a.covariance.matrix();
                    let numbers = a.rate.0.iter().chain(matrix.iter());
                    assert!(numbers.copied().all(f64::is_finite), "{what}: {a:?}");
                }
                let report = run.propagation;
                assert!(report.angle_turned.is_finite() && report.integrated_secs.is_finite());
                let outcome = std::panic::catch_unwind(|| (case.check)(&run, kind, method));
                assert!(outcome.is_ok(), "{what}");
            }
        }
    }
}

#[test]
fn windows_out_of_range_are_refused_for_every_kind_and_name_the_flag() {
    for kind in KINDS {
        let smallest = if kind == SampleKind::Rate { 2 } else { 1 };
        for window in [0, 1, 2, 24, 25, 1000, usize::MAX] {
            for method in [
                Method::Magnus {
                    window,
                    order: Order::Exact,
                    placement: Placement::Centred,
                },
                Method::Magnus {
                    window,
                    order: Order::M6,
                    placement: Placement::Causal,
                },
                Method::CommitProvisional {
                    window,
                    order: Order::M8,
                    finals: true,
                },
            ] {
                let made = Propagator::new(Settings {
                    method,
                    kind,
                    ..Settings::default()
                });
                let fits = (smallest..=LARGEST_WINDOW).contains(&window);
                match made {
                    Ok(_) => assert!(fits, "{method}, {kind:?}"),
                    Err(why) => {
                        let said = why.to_string();
                        let range = format!("window takes {smallest} to 24");
                        assert!(!fits && said.contains(&range), "{method}, {kind:?}: {said}");
                    }
                }
            }
        }
    }
}
