#![allow(clippy::unwrap_used, clippy::expect_used)]

use super::*;
use crate::frames::{Body, Nav};
use nalgebra::Vector3;

type Q = Quaternion<Nav, Body>;

fn turn(x: f64, y: f64, z: f64) -> RotationVector {
    RotationVector(Vector3::new(x, y, z))
}

/// A restless motion: no axis stands still, and it turns through all octants.
fn truth(secs: f64) -> Q {
    Q::from_rotation_vector(&turn(0.3, -0.2, 1.1 * secs)).advanced(&turn(
        (0.7 * secs).sin(),
        0.9 * (1.3 * secs).cos(),
        0.2 * secs,
    ))
}

fn nanos(secs: f64) -> Nanos {
    Nanos(1_700_000_000_000_000_000 + (secs * 1e9).round() as i64)
}

/// `n` samples of the truth at `hz`, passed through `change(secs, q)`.
fn track(n: usize, hz: f64, change: impl Fn(f64, Q) -> Q) -> Vec<Stamped> {
    (0..n)
        .map(|i| i as f64 / hz)
        .map(|t| (nanos(t), change(t, truth(t))))
        .collect()
}

fn world(x: f64, y: f64, z: f64) -> Quaternion<Nav, Nav> {
    Quaternion::from_rotation_vector(&turn(x, y, z))
}

fn nan() -> Q {
    Q::assume_unit([f64::NAN; 4])
}

fn error_series(estimate: &[Stamped], reference: &[Stamped], align: Align) -> Vec<ErrorAt> {
    let mut series = Vec::new();
    for_each_error(estimate, reference, align, |at| series.push(*at));
    series
}

#[test]
fn an_estimate_equal_to_the_reference_has_no_error() {
    let a = track(500, 100.0, |_, q| q);
    for align in Align::ALL {
        let c = compare(&a, &a, align);
        let e = c.errors.unwrap();
        assert_eq!(c.samples, 500);
        assert_eq!(c.span, Some((a[0].0, a[499].0)));
        // Roundings of two or three quaternion products.
        assert!(e.total.max < 2e-15, "{align}: {e:?}");
        assert!(c.drift.unwrap().total_deg_per_hour() < 1e-9);
        let r = c.relative_1s.unwrap();
        assert_eq!(r.count, 400);
        assert!(r.p95 < 2e-15);
        assert_eq!(c.left_out, LeftOut::default());
    }
}

#[test]
fn each_alignment_takes_out_what_it_says_and_no_more() {
    let reference = track(300, 100.0, |_, q| q);
    let tilted = world(0.2, -0.1, 0.9);
    let turned = world(0.0, 0.0, 0.9);
    for (offset, align, left) in [
        (
            tilted,
            Align::None,
            tilted.angle_to(&Quaternion::identity()),
        ),
        (tilted, Align::First, 0.0),
        (tilted, Align::Best, 0.0),
        (turned, Align::None, 0.9),
        (turned, Align::Heading, 0.0),
        (turned, Align::Best, 0.0),
    ] {
        let estimate = track(300, 100.0, |_, q| offset * q);
        let c = compare(&estimate, &reference, align);
        let total = c.errors.unwrap().total;
        // Roundings; an offset not taken out is 0.2 rad or more.
        assert!((total.rms - left).abs() < 5e-15, "{align}: {total:?}");
        if left == 0.0 {
            assert!(c.alignment.angle_to(&offset.inverse()) < 5e-15);
        }
        // No choice of world changes how a second of motion was followed.
        assert!(c.relative_1s.unwrap().p95 < 2e-15);
    }
    // Heading alignment leaves the tilt: the least angle left by any turn about z.
    let estimate = track(300, 100.0, |_, q| tilted * q);
    let e = compare(&estimate, &reference, Align::Heading)
        .errors
        .unwrap();
    let [w, x, y, z] = tilted.wxyz();
    let tilt = 2.0 * x.hypot(y).atan2(w.hypot(z));
    assert!((e.inclination.rms - tilt).abs() < 5e-15);
    assert!((e.total.rms - tilt).abs() < 5e-15 && e.heading.max < 5e-15);
}

#[test]
fn best_is_better_than_first_and_than_its_neighbours() {
    let reference = track(400, 100.0, |_, q| q);
    let estimate = track(400, 100.0, |t, q| {
        (world(0.1, 0.4, -0.2) * world(0.02 * (9.0 * t).sin(), 0.01 * t, 0.03 * (4.0 * t).cos()))
            * q
    });
    // What the mean minimises, Markley 2007 eq. 5: sum of 8 sin^2(angle/2).
    let cost = |tilt: Quaternion<Nav, Nav>| {
        let best = compare(&estimate, &reference, Align::Best).alignment;
        let moved: Vec<Stamped> = estimate
            .iter()
            .map(|(t, q)| (*t, tilt * best * *q))
            .collect();
        error_series(&moved, &reference, Align::None)
            .iter()
            .map(|e| (0.5 * e.total).sin().powi(2))
            .sum::<f64>()
    };
    let least = cost(Quaternion::identity());
    for step in [(1e-4, 0.0, 0.0), (0.0, 1e-4, 0.0), (0.0, 0.0, 1e-4)] {
        let (x, y, z) = step;
        assert!(cost(world(x, y, z)) > least && cost(world(-x, -y, -z)) > least);
    }
    let rms = |align| {
        compare(&estimate, &reference, align)
            .errors
            .unwrap()
            .total
            .rms
    };
    assert!(rms(Align::Best) < rms(Align::First));
}

#[test]
fn heading_and_inclination_are_about_the_worlds_vertical_not_the_bodys() {
    let reference = track(200, 100.0, |_, q| q);
    let ahead = track(200, 100.0, |_, q| world(0.0, 0.0, 0.05) * q);
    let series = error_series(&ahead, &reference, Align::None);
    assert_eq!(series.len(), 200);
    for e in series {
        // Sign: the estimate is ahead. Roundings.
        assert!((e.heading - 0.05).abs() < 2e-15 && e.inclination < 2e-15);
    }
    let behind: Vec<Stamped> = track(200, 100.0, |_, q| world(0.0, 0.0, -0.05) * q);
    let heading = compare(&behind, &reference, Align::None)
        .errors
        .unwrap()
        .heading;
    assert!((heading.mean - 0.05).abs() < 2e-15 && (heading.max - 0.05).abs() < 2e-15);
    // q and -q are one attitude.
    let minus = |(t, q): &Stamped| (*t, Q::assume_unit(q.wxyz().map(|c| -c)));
    let negated: Vec<Stamped> = reference.iter().map(minus).collect();
    assert_eq!(
        error_series(&behind, &negated, Align::None),
        error_series(&behind, &reference, Align::None)
    );
    let leaning = track(200, 100.0, |_, q| world(0.03, -0.04, 0.0) * q);
    for e in error_series(&leaning, &reference, Align::None) {
        assert!((e.inclination - 0.05).abs() < 2e-15 && e.heading.abs() < 2e-15);
    }
}

#[test]
fn drift_is_the_slope_of_the_error_and_survives_full_turns() {
    let reference = track(3600, 1.0, |_, q| q);
    // 3 deg/h about z; and 2000 deg/h about a slanted axis, five and a half turns in the hour, with
    // a wobble that blurs the axis near full turns.
    for (rate, axis) in [
        (3.0, Vector3::z()),
        (2000.0, Vector3::new(2.0, -1.0, 2.0) / 3.0),
    ] {
        let estimate = track(3600, 1.0, |t, q| {
            let phi = axis * (f64::to_radians(rate) * t / 3600.0);
            let wobble = world(1e-3 * (2.3 * t).sin(), 1e-3 * (1.7 * t).cos(), 0.0);
            Quaternion::<Nav, Nav>::from_rotation_vector(&RotationVector(phi)) * wobble * q
        });
        let drift = compare(&estimate, &reference, Align::None).drift.unwrap();
        // The wobble of 1e-3 rad, seen through near-full turns, moves the slope by a few parts
        // in a thousand; a lost turn would move it by tenths.
        let total = drift.total_deg_per_hour();
        assert!(
            (total / rate - 1.0).abs() < 5e-3,
            "{total} instead of {rate}"
        );
        let heading = drift.heading_deg_per_hour();
        assert!((heading - rate * axis.z).abs() < 5e-3 * rate, "{heading}");
    }
}

#[test]
fn the_estimate_is_interpolated_on_the_great_arc() {
    let spin = |secs: f64| (nanos(secs), Q::from_rotation_vector(&turn(0.0, 0.0, secs)));
    let estimate: Vec<Stamped> = (0..=20).map(|i| spin(f64::from(i) * 0.1)).collect();
    let reference: Vec<Stamped> = (0..1000).map(|i| spin(f64::from(i) * 0.00199)).collect();
    let e = compare(&estimate, &reference, Align::None).errors.unwrap();
    // Stamps are whole nanoseconds; at 1 rad/s that is half a nanorad each.
    assert!(e.total.max < 1.01e-9, "{e:?}");
}

#[test]
fn gaps_ends_and_rows_that_are_no_attitude_are_left_out_and_counted() {
    let mut reference = track(1000, 100.0, |_, q| q);
    let mut estimate: Vec<Stamped> = track(1000, 100.0, |_, q| q)
        .into_iter()
        .enumerate()
        .filter(|(i, _)| (100..900).contains(i) && !(300..400).contains(i))
        .map(|(_, row)| row)
        .collect();
    for i in [0, 200, 201, 350, 500] {
        reference[i].1 = nan();
    }
    estimate[700 - 200].1 = Q::assume_unit([0.0; 4]);
    let c = compare(&estimate, &reference, Align::Best);
    assert_eq!(
        c.left_out,
        LeftOut {
            bad_estimates: 1,
            bad_references: 5,
            outside: 199, // 0..100 and 900..1000, one of them NaN
            in_gap: 99,   // 300..400, one of them NaN
        }
    );
    assert_eq!(c.samples + 5 + 199 + 99, 1000);
    // One sample is interpolated over 20 ms of angular accelerations up to 4 rad/s^2: a h^2/8.
    assert!(c.errors.unwrap().total.max < 2e-4);
}

#[test]
fn the_one_second_error_pairs_samples_a_second_apart_and_only_those() {
    // 10 Hz for 3 s, the middle second missing: only 2.0 s has a partner, 3.0 s.
    let all = track(31, 10.0, |_, q| q);
    let holed: Vec<Stamped> = all
        .iter()
        .copied()
        .enumerate()
        .filter(|(i, _)| !(10..20).contains(i))
        .map(|(_, row)| row)
        .collect();
    let r = compare(&all, &holed, Align::None).relative_1s.unwrap();
    assert_eq!(r.count, 1);
    let r = compare(&all, &all, Align::None).relative_1s.unwrap();
    assert_eq!(r.count, 21);
    // An error that grows at 0.01 rad/s about z is 0.01 rad in every second.
    let drifting = track(31, 10.0, |t, q| world(0.0, 0.0, 0.01 * t) * q);
    let r = compare(&drifting, &all, Align::None).relative_1s.unwrap();
    assert!((r.median - 0.01).abs() < 1e-14 && (r.p95 - 0.01).abs() < 1e-14);
    // Less than a second of reference: nothing.
    assert_eq!(compare(&all, &all[..8], Align::None).relative_1s, None);
}

#[test]
fn the_nearest_estimate_is_taken_for_the_one_second_error() {
    // 2 ms before each reference sample lies an estimate that agrees with it, 3 ms after it one
    // that turns the other way.
    let spin = |secs: f64| Q::from_rotation_vector(&turn(0.0, 0.0, secs));
    let reference: Vec<Stamped> = (0..30)
        .map(|i| f64::from(i) * 0.1)
        .map(|t| (nanos(t), spin(t)))
        .collect();
    let estimate: Vec<Stamped> = (0..30)
        .map(|i| f64::from(i) * 0.1)
        .flat_map(|t| [(nanos(t - 2e-3), spin(t)), (nanos(t + 3e-3), spin(-t))])
        .collect();
    let r = compare(&estimate, &reference, Align::None)
        .relative_1s
        .unwrap();
    assert_eq!(r.count, 20);
    assert!(r.p95 < 2e-15, "{r:?}");
}

#[test]
fn order_and_repetition_of_rows_do_not_matter() {
    let reference = track(400, 100.0, |_, q| q);
    let estimate = track(400, 100.0, |t, q| world(0.0, 0.01 * t, 0.0) * q);
    let want = compare(&estimate, &reference, Align::Best);
    let mut shuffled = estimate.clone();
    shuffled.reverse();
    shuffled.swap(3, 300);
    let mut repeated = shuffled.clone();
    repeated.extend_from_slice(&estimate[50..90]);
    for other in [shuffled, repeated] {
        assert_eq!(compare(&other, &reference, Align::Best), want);
    }
}

#[test]
fn nothing_one_sample_no_overlap_and_hostile_stamps_are_all_survived() {
    let some = track(50, 100.0, |_, q| q);
    let elsewhere: Vec<Stamped> = some
        .iter()
        .map(|(t, q)| (Nanos(t.0 - i64::MAX / 4), *q))
        .collect();
    let extremes = vec![
        (Nanos(i64::MIN), Q::identity()),
        (Nanos(0), Q::identity()),
        (Nanos(i64::MAX), Q::identity()),
    ];
    let same_instant = vec![some[0]; 9];
    let tracks = [
        vec![],
        vec![some[0]],
        some.clone(),
        elsewhere,
        extremes,
        same_instant,
        vec![(some[3].0, nan())],
    ];
    for estimate in &tracks {
        for reference in &tracks {
            for align in Align::ALL {
                let c = compare(estimate, reference, align);
                assert_eq!(c.errors.is_some(), c.samples > 0);
                assert_eq!(
                    c.samples + c.left_out.outside + c.left_out.in_gap + c.left_out.bad_references,
                    reference.len()
                );
                assert!(c.alignment.wxyz().iter().all(|c| c.is_finite()));
            }
        }
    }
    let one = compare(&some[..1], &some[..1], Align::Best);
    assert_eq!((one.samples, one.drift, one.relative_1s), (1, None, None));
}

#[test]
fn quantiles_are_those_of_numpy() {
    let mut values = [15.0, 20.0, 35.0, 40.0, 50.0];
    // numpy 2 quantile([15, 20, 35, 40, 50], [0, .25, .4, .5, .95, 1])
    for (p, want) in [
        (0.0, 15.0),
        (0.25, 20.0),
        (0.4, 29.0),
        (0.5, 35.0),
        (0.95, 48.0),
        (1.0, 50.0),
    ] {
        let got = statistics::quantile(&mut values, p).unwrap();
        assert!((got - want).abs() < 1e-13, "{p}: {got}"); // one rounding of numbers near 50
    }
    assert_eq!(statistics::quantile(&mut [], 0.5), None);
}

#[test]
fn alignments_are_known_by_name() {
    for align in Align::ALL {
        assert_eq!(align.name().parse(), Ok(align));
    }
    assert_eq!("Best ".parse::<Align>(), Err(ParseAlignError));
}

/// A reference whose heading is another from each cut on, and an estimate with a bias.
fn reset_twice() -> (Vec<Stamped>, Vec<Stamped>, Vec<Nanos>) {
    let reference = track(6000, 100.0, |t, q| {
        let heading = [0.0, 1.2, -0.7][(t / 20.0) as usize];
        world(0.0, 0.0, heading) * q
    });
    let estimate = track(6000, 100.0, |t, q| world(0.0, 0.0, 1e-3 * t) * q);
    (estimate, reference, vec![nanos(20.0), nanos(40.0)])
}

#[test]
fn a_reference_that_is_set_anew_is_cut_and_each_part_aligned_by_itself() {
    let (estimate, rows, cuts) = reset_twice();
    let whole = compare(&estimate, &rows, Align::First);
    assert!(whole.errors.unwrap().heading.rms > 0.5 && whole.parts == 1);
    let reference = Reference {
        rows: &rows,
        cuts: &cuts,
    };
    let found = compare(&estimate, reference, Align::First);
    // Twenty seconds of 1 mrad/s.
    let errors = found.errors.unwrap();
    assert!((errors.heading.max - 0.02).abs() < 1e-4, "{errors:?}");
    assert_eq!((found.parts, found.samples), (3, 6000));
    let drift = found.drift.unwrap().rate_n.z;
    assert!((drift - 1e-3).abs() < 1e-6, "a line in each: {drift}");
    let relative = found.relative_1s.unwrap();
    assert_eq!(relative.count, 3 * 1900, "nothing across a cut");
    assert!(relative.p95 < 1.1e-3, "{relative:?}");
    let mut last = None;
    for_each_error(&estimate, reference, Align::First, |at| {
        assert!(at.heading.abs() < 0.021 && last.replace(at.stamp) < Some(at.stamp));
    });
}

#[test]
fn cuts_before_and_after_everything_in_any_order_and_twice_are_none() {
    let (estimate, rows, cuts) = reset_twice();
    let mut more = vec![nanos(-5.0), nanos(90.0), cuts[1], cuts[0], cuts[1]];
    let found = |cuts: &[Nanos]| {
        let reference = Reference { rows: &rows, cuts };
        compare(&estimate, reference, Align::Heading)
    };
    assert_eq!(found(&more), found(&cuts));
    more.clear();
    assert_eq!(found(&more), compare(&estimate, &rows, Align::Heading));
}
