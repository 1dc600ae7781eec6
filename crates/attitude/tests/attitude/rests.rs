//! Files that begin, end, or only seem to rest -> the bias that is taken out by default, and what heading makes of it.

use nalgebra::{Rotation3, Vector3};
use strapd_attitude::estimate::{
    Aid, Bias, EstimationSettings, Estimator, Meaning, NOISE_PRESETS, Noise, Patience, Preparation,
    Prepared, at_once,
};
use strapd_attitude::propagate::{Method, Sequential};
use strapd_attitude::quaternion::BodyRate;
use strapd_attitude::record::{Declared, Nanos, RawSample, SampleKind};

const HZ: f64 = 100.0;
const G: f64 = 9.806_65;
const DEG: f64 = std::f64::consts::PI / 180.0;
/// A gyro's bias as its class has it, deg/s.
const ORDINARY: [f64; 3] = [0.6, -0.4, 0.8];

/// A body: rate (rad/s, body axes) and acceleration (m/s^2, world) at a time, s.
type Motion<'a> = &'a dyn Fn(f64) -> (Vector3<f64>, Vector3<f64>);

struct Body<'a> {
    secs: f64,
    motion: Motion<'a>,
    /// deg/s.
    bias: [f64; 3],
    /// Size of the forces that are measured.
    scale: f64,
    start: Rotation3<f64>,
}

/// Samples and the true heading at each, rad, without jumps.
type Log = (Vec<RawSample>, Vec<Rotation3<f64>>);

/// Numbers that look like noise: the same each time, unit variance.
struct Noise12(u64);

impl Noise12 {
    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| {
            let mut sum = -6.0;
            for _ in 0..12 {
                self.0 = self
                    .0
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum * sigma
        })
    }
}

impl<'a> Body<'a> {
    fn new(secs: f64, motion: Motion<'a>) -> Body<'a> {
        Body {
            secs,
            motion,
            bias: ORDINARY,
            scale: 1.0,
            start: Rotation3::identity(),
        }
    }

    fn log(&self) -> Log {
        let (mut at, mut noise) = (self.start, Noise12(7));
        let (mut samples, mut truth) = (Vec::new(), Vec::new());
        for k in 0..=(self.secs * HZ) as i64 {
            let t = k as f64 / HZ;
            let mut mean = (self.motion)(t).0;
            if k > 0 {
                mean = Vector3::zeros();
                for part in [0.125, 0.375, 0.625, 0.875] {
                    let rate = (self.motion)(t - (1.0 - part) / HZ).0;
                    at *= Rotation3::from_scaled_axis(rate * (0.25 / HZ));
                    mean += rate * 0.25;
                }
            }
            let force = at.inverse() * ((self.motion)(t).1 + Vector3::z() * G) * self.scale;
            let bias = Vector3::from(self.bias) * DEG;
            samples.push(RawSample {
                header: Some(Nanos(k * 10_000_000)),
                log: Nanos(k * 10_000_000),
                gyro: Some((mean + bias + noise.vector(0.07 * DEG)).into()),
                accel: Some((force + noise.vector(0.02)).into()),
                ..RawSample::default()
            });
            truth.push(at);
        }
        (samples, truth)
    }
}

/// A plan as the command has it where nobody says more.
fn default() -> EstimationSettings {
    EstimationSettings {
        aid: Aid::Auto,
        kind: Some(SampleKind::Average),
        ..EstimationSettings::default()
    }
}

fn prepared(plan: &EstimationSettings, samples: &[RawSample], patience: Patience) -> Prepared {
    let meaning = Meaning::new(plan, &Declared::default());
    let mut preparation = Preparation::new(plan, &meaning, patience);
    for sample in samples {
        if !preparation.wants_more() {
            break;
        }
        preparation.take(sample).unwrap();
    }
    preparation.decide().unwrap()
}

/// Outcome of a file.
struct Seen {
    prepared: Prepared,
    /// Largest error of the heading against that of the first sample, degrees, and its share within three sigmas.
    most: f64,
    within: f64,
    /// Error of the bias along the vertical at the end, and its sigma, deg/s.
    bias: f64,
    sigma: f64,
}

fn seen(plan: &EstimationSettings, body: &Body<'_>) -> Seen {
    let (samples, truth) = body.log();
    let prepared = prepared(plan, &samples, Patience::WholeLog);
    let meaning = Meaning::new(plan, &Declared::default());
    let mut estimator = Estimator::new(plan, &meaning, &prepared).unwrap();
    samples.iter().for_each(|sample| estimator.take(sample));
    let out = estimator.finish(&Sequential);
    assert_eq!(out.len(), truth.len());
    let (mut most, mut within, mut last, mut turns, mut first) = (0.0_f64, 0, 0.0, 0.0, None);
    for (sample, truth) in out.iter().zip(&truth) {
        let off = *sample.q_nb.to_dcm().as_matrix() * truth.matrix().transpose();
        let heading = (off[(1, 0)] - off[(0, 1)]).atan2(off[(0, 0)] + off[(1, 1)]);
        turns += ((last - heading) / std::f64::consts::TAU).round();
        last = heading;
        let heading = heading + turns * std::f64::consts::TAU;
        let heading = heading - *first.get_or_insert(heading);
        let sigma = sample.covariance.in_navigation_axes(&sample.q_nb)[(2, 2)].sqrt();
        most = most.max(heading.abs() / DEG);
        within += usize::from(heading.abs() <= 3.0 * sigma);
    }
    let filter = estimator.filter().unwrap();
    let up = truth.last().unwrap().inverse() * Vector3::z();
    let found = prepared.bias.0 + filter.calibration().bias - Vector3::from(body.bias) * DEG;
    Seen {
        most,
        within: within as f64 / out.len() as f64,
        bias: found.dot(&up) / DEG,
        sigma: filter.calibration_sigma().bias.max() / DEG,
        prepared,
    }
}

impl Seen {
    fn is_by_default(&self) -> bool {
        self.prepared.bias_origin.contains("of rest")
            && self.prepared.bias_origin.contains("by default")
    }

    fn warns_of_a_turn(&self) -> bool {
        self.prepared
            .warnings
            .iter()
            .any(|w| w.what().contains("steady turn"))
    }
}

/// A hand that moves from `from` to `to`, s, and lies still otherwise.
fn hand(from: f64, to: f64) -> impl Fn(f64) -> (Vector3<f64>, Vector3<f64>) {
    move |t| {
        let much = (t - from).min(to - t).clamp(0.0, 1.0);
        let rate = Vector3::new(
            (1.9 * t).sin() + 0.5 * (3.1 * t).cos(),
            0.8 * (2.3 * t + 1.0).sin(),
            0.7 * (1.3 * t).cos() + 0.4 * (2.9 * t).sin(),
        );
        let push = Vector3::new((5.0 * t).sin(), (4.1 * t).cos(), 0.6 * (6.3 * t).sin());
        (rate * much, push * much)
    }
}

fn still() -> Vector3<f64> {
    Vector3::zeros()
}

#[test]
fn the_rest_of_a_file_is_its_bias_wherever_it_is() {
    for (what, from, to) in [("first", 10.0, 60.0), ("last", 0.0, 50.0)] {
        let motion = hand(from, to);
        let body = Body::new(60.0, &motion);
        let by_rest = seen(&default(), &body);
        assert!(
            by_rest.is_by_default(),
            "{what} {}",
            by_rest.prepared.bias_origin
        );
        let left = by_rest.prepared.aiding.unwrap().settings.bias_prior / DEG;
        assert!((0.14..0.17).contains(&left), "{what} {left}");
        let none = EstimationSettings {
            bias: Bias::None,
            ..default()
        };
        let without = seen(&none, &body);
        assert_eq!(
            (without.prepared.bias, &*without.prepared.bias_origin),
            (BodyRate::ZERO, "none")
        );
        assert!(by_rest.within > 0.997 && without.within > 0.997, "{what}");
        // Last: 1.7 degrees where it is taken out, 6.6 where it has to be learned.
        assert!(
            by_rest.most < 0.5 * without.most,
            "{what} {} {}",
            by_rest.most,
            without.most
        );
    }
}

#[test]
fn what_cannot_be_read_twice_and_what_was_said_are_as_they_were() {
    let motion = hand(10.0, 20.0);
    let (samples, _) = Body::new(20.0, &motion).log();
    let stream = prepared(&default(), &samples, Patience::FirstMinute);
    let meaning = Meaning::new(&default(), &Declared::default());
    let live = at_once(&default(), &meaning, &samples[..1]).unwrap();
    let daemon = EstimationSettings {
        method: Method::COMMIT,
        ..default()
    };
    let alone = EstimationSettings {
        aid: Aid::None,
        ..default()
    };
    let [daemon, alone] = [daemon, alone].map(|plan| prepared(&plan, &samples, Patience::WholeLog));
    for prepared in [stream, live, daemon, alone] {
        assert_eq!(
            (prepared.bias, &*prepared.bias_origin),
            (BodyRate::ZERO, "none")
        );
        assert_eq!(prepared.bias_left, None);
    }
    let given = EstimationSettings {
        bias: Bias::Given(BodyRate(Vector3::x() * 0.01)),
        ..default()
    };
    assert_eq!(
        prepared(&given, &samples, Patience::WholeLog).bias_origin,
        "as given"
    );
    // A class that knows it better than a rest does.
    let tactical = EstimationSettings {
        noise: Noise::preset(&NOISE_PRESETS[3]),
        ..default()
    };
    assert_eq!(
        prepared(&tactical, &samples, Patience::WholeLog).bias_origin,
        "none"
    );
}

#[test]
fn a_turntable_is_no_rest() {
    // Steady from the first sample on: with its rate taken for the bias, 240 degrees wrong under a sigma of a quarter.
    let up = Vector3::z() * (2.0 * DEG);
    let motion = |_| (up, still());
    let body = Body {
        bias: [0.05, -0.03, 0.04],
        ..Body::new(120.0, &motion)
    };
    let table = seen(&default(), &body);
    assert!(
        table.warns_of_a_turn() && !table.is_by_default(),
        "{:?}",
        table.prepared.warnings
    );
    assert!(
        table.most < 10.0 && table.within > 0.99,
        "{} {}",
        table.most,
        table.within
    );
    assert!(
        table.sigma > 0.9 && table.bias.abs() < 0.2,
        "{} {}",
        table.sigma,
        table.bias
    );
    // Who says so has it taken for the bias, and reads that it may be none.
    let said = EstimationSettings {
        bias: Bias::Auto,
        ..default()
    };
    let said = seen(&said, &body);
    assert!(said.most > 200.0 && said.prepared.bias_origin.contains("or a steady turn"));
}

#[test]
fn a_turntable_as_slow_as_a_bias_is_no_rest_by_its_direction() {
    // 1 deg/s is what a gyro of the class has, but not along the vertical alone.
    let up = Vector3::z() * DEG;
    let motion = |_| (up, still());
    let body = Body {
        bias: [0.05, -0.03, 0.04],
        ..Body::new(120.0, &motion)
    };
    let table = seen(&default(), &body);
    assert!(table.warns_of_a_turn() && !table.is_by_default());
    assert!(
        table.most < 10.0 && table.within > 0.99 && table.sigma > 0.9,
        "{} {} {}",
        table.most,
        table.within,
        table.sigma
    );
    // The filter by itself, of a stream or with the bias left in, learns nothing of it either.
    let none = EstimationSettings {
        bias: Bias::None,
        ..default()
    };
    let table = seen(&none, &body);
    assert!(
        table.most < 10.0 && table.within > 0.99 && table.sigma > 0.9,
        "{} {} {}",
        table.most,
        table.within,
        table.sigma
    );
}

#[test]
fn a_turntable_that_starts_from_rest_has_the_bias_of_its_rest() {
    let start = |t: f64| (Vector3::z() * ((t - 20.0).clamp(0.0, 1.0) * DEG), still());
    let table = seen(&default(), &Body::new(120.0, &start));
    assert!(table.is_by_default() && table.warns_of_a_turn());
    assert!(
        table.most < 1.0 && table.within > 0.99 && table.bias.abs() < 0.02,
        "{} {} {}",
        table.most,
        table.within,
        table.bias
    );
}

#[test]
fn a_bias_along_the_vertical_of_a_body_that_moves_later_is_a_bias() {
    let moved = hand(10.0, 20.0);
    let body = Body {
        bias: [0.02, 0.03, 1.0],
        ..Body::new(26.0, &moved)
    };
    let rest = seen(&default(), &body);
    assert!(
        rest.is_by_default() && !rest.warns_of_a_turn() && rest.most < 1.0,
        "{} {:?}",
        rest.most,
        rest.prepared.warnings
    );
    // A filter that has not read ahead learns it when the body has come back to rest.
    let none = EstimationSettings {
        bias: Bias::None,
        ..default()
    };
    let filter = seen(&none, &body);
    assert!(
        filter.bias.abs() < 0.05 && filter.sigma < 0.1 && filter.within > 0.99,
        "{} {} {}",
        filter.bias,
        filter.sigma,
        filter.within
    );
}

#[test]
fn a_steady_turn_about_another_axis_takes_gravity_along() {
    for rate in [0.5, 2.0] {
        let axis = Vector3::new(0.5, 0.0, 0.75_f64.sqrt()) * (rate * DEG);
        let motion = |_| (axis, still());
        let body = Body {
            bias: [0.05, -0.03, 0.04],
            ..Body::new(60.0, &motion)
        };
        let turn = seen(&default(), &body);
        assert!(
            !turn.is_by_default(),
            "{rate} {}",
            turn.prepared.bias_origin
        );
        assert!(
            turn.within > 0.99 && turn.most < 10.0,
            "{rate} {} {}",
            turn.most,
            turn.within
        );
        // Nor for who asks for the bias of a rest.
        let (samples, _) = body.log();
        let said = EstimationSettings {
            bias: Bias::Auto,
            ..default()
        };
        let meaning = Meaning::new(&said, &Declared::default());
        let mut preparation = Preparation::new(&said, &meaning, Patience::WholeLog);
        samples
            .iter()
            .for_each(|sample| preparation.take(sample).unwrap());
        assert!(preparation.decide().is_err());
    }
}

#[test]
fn a_large_bias_that_points_anywhere_or_comes_back_is_a_bias() {
    // Across the vertical, too.
    let motion = |_| (still(), still());
    let body = Body {
        bias: [1.0, -0.5, 2.2],
        ..Body::new(30.0, &motion)
    };
    let rest = seen(&default(), &body);
    assert!(rest.is_by_default() && rest.most < 1.0, "{}", rest.most);
    // Along it alone, but the same after the body was moved and laid down again.
    let moved = hand(10.0, 20.0);
    let body = Body {
        bias: [0.0, 0.1, 2.2],
        ..Body::new(30.0, &moved)
    };
    let rest = seen(&default(), &body);
    assert!(
        rest.is_by_default() && rest.most < 1.0,
        "{} {:?}",
        rest.most,
        rest.prepared.warnings
    );
}

#[test]
fn a_ship_a_curve_and_a_robot_that_turns_at_both_ends_have_no_rest() {
    let swell = |t: f64| {
        let rate = Vector3::new(
            1.9 * (0.63 * t).cos(),
            0.8 * (0.82 * t + 1.0).cos(),
            0.3 * (0.03 * t + 0.5).sin(),
        );
        let push = Vector3::new(
            0.3 * (0.63 * t).sin(),
            0.2 * (0.75 * t).sin(),
            0.2 * (0.69 * t).sin(),
        );
        (rate * DEG, push)
    };
    let curve = |t: f64| {
        let rate = if t < 20.0 {
            12.0
        } else {
            10.0 * (0.3 * t).sin()
        } * DEG;
        let yaw = if t < 20.0 {
            12.0 * DEG * t
        } else {
            240.0 * DEG + 10.0 * DEG / 0.3 * ((6.0_f64).cos() - (0.3 * t).cos())
        };
        let inwards =
            Vector3::new(-yaw.sin(), yaw.cos(), 0.0) * (10.0 * rate + 0.3 * (40.0 * t).sin());
        (
            Vector3::new(0.3 * (3.0 * t).sin(), 0.3 * (2.3 * t).sin(), rate / DEG) * DEG,
            inwards,
        )
    };
    let robot = |t: f64| {
        let rate = match t {
            t if t < 1.2 => 2.5,
            t if t > 58.8 => 2.2,
            t => 25.0 * (0.9 * t).sin() + 12.0 * (0.31 * t).cos(),
        };
        (Vector3::z() * (rate * DEG), still())
    };
    let motions: [(&str, Motion<'_>, [f64; 3]); 3] = [
        ("ship", &swell, ORDINARY),
        ("curve", &curve, ORDINARY),
        ("robot", &robot, [0.1, -0.1, 0.05]),
    ];
    for (what, motion, bias) in motions {
        let body = Body {
            bias,
            ..Body::new(60.0, motion)
        };
        let moving = seen(&default(), &body);
        assert!(
            !moving.is_by_default(),
            "{what} {}",
            moving.prepared.bias_origin
        );
        assert!(
            moving.within > 0.97,
            "{what} {} {}",
            moving.most,
            moving.within
        );
    }
}

#[test]
fn an_accelerometer_that_reads_too_little_and_half_a_second_are_no_obstacle() {
    let motion = hand(10.0, 40.0);
    let body = Body {
        scale: 0.96,
        ..Body::new(40.0, &motion)
    };
    let short = seen(&default(), &body);
    assert!(
        short.is_by_default() && short.most < 0.5 && short.within > 0.99,
        "{} {}",
        short.most,
        short.within
    );
    let motion = |_| (Vector3::new(0.3, 0.2, 0.1), still());
    let half = seen(&default(), &Body::new(0.5, &motion));
    assert!(
        !half.is_by_default() && half.within == 1.0 && half.most < 1.0,
        "{} {}",
        half.most,
        half.within
    );
}

/// Tilt of the first attitude of a shaken body whose forces come apart from its rates, degrees off the truth.
fn first_tilt(plan: &EstimationSettings, read_ahead: bool) -> f64 {
    let motion = |t: f64| {
        (
            Vector3::x() * (0.5 * (2.0 * t).sin()),
            Vector3::new(6.0 * (44.0 * t).cos(), 5.0 * (57.0 * t).cos(), 0.0),
        )
    };
    let body = Body {
        start: Rotation3::from_scaled_axis(Vector3::x() * 0.3),
        ..Body::new(3.0, &motion)
    };
    let (samples, truth) = body.log();
    let apart: Vec<RawSample> = samples
        .iter()
        .flat_map(|raw| {
            let force = RawSample {
                gyro: None,
                is_beside: true,
                ..*raw
            };
            [
                force,
                RawSample {
                    accel: None,
                    ..*raw
                },
            ]
        })
        .collect();
    let meaning = Meaning::new(plan, &Declared::default());
    let prepared = if read_ahead {
        prepared(plan, &apart, Patience::WholeLog)
    } else {
        at_once(plan, &meaning, &apart[..2]).unwrap()
    };
    let mut estimator = Estimator::new(plan, &meaning, &prepared).unwrap();
    apart.iter().for_each(|raw| estimator.take(raw));
    let out = estimator.finish(&Sequential);
    let up = out[0].q_nb.to_dcm().as_matrix().transpose() * Vector3::z();
    up.angle(&(truth[0].inverse() * Vector3::z())) / DEG
}

#[test]
fn forces_of_their_own_level_a_file_by_their_mean() {
    let plan = EstimationSettings {
        has_forces_beside: true,
        ..default()
    };
    let (file, stream) = (first_tilt(&plan, true), first_tilt(&plan, false));
    // A stream has the first alone.
    assert!(file < 2.0 && stream > 20.0, "{file} {stream}");
}
