//! One test per rule of the policy table in `crates/attitude/src/condition.rs`.

use super::{STEP, T0, at, run, sample};
use nalgebra::{Matrix3, Rotation3, Vector3};
use strapd_attitude::condition::{
    Clock, ClockWarning, Conditioner, GAPS_KEPT, GyroUnit, OnGap, Settings, SpikePolicy,
    StampRepair, choose_clock,
};
use strapd_attitude::frames::Dcm;
use strapd_attitude::quaternion::BodyRate;
use strapd_attitude::record::{Join, Nanos, RateSample, RawSample, SampleKind, Status, Verdict};

fn stream(n: i64) -> Vec<RawSample> {
    (0..n).map(sample).collect()
}

pub(super) fn kind(kind: SampleKind) -> Settings {
    Settings {
        kind,
        ..Settings::default()
    }
}

/// Steps of the output in units of the ordinary one.
fn steps(out: &[RateSample]) -> Vec<f64> {
    out.windows(2)
        .map(|w| w[1].stamp.since(w[0].stamp) as f64 / STEP as f64)
        .collect()
}

#[test]
fn colliding_stamps_move_into_the_longer_step_after_them() {
    let mut raw = stream(100);
    raw[50].header = raw[49].header;
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::Restamped), 1);
    assert_eq!(report.first_bad(Verdict::Restamped).unwrap().index, 50);
    assert_eq!(out.len(), 100);
    assert_eq!(out[50].stamp, Nanos(T0 + 50 * STEP));
    assert!(out[50].status.has(Status::RESTAMPED));
    assert_eq!(report.gaps.count, 0);
}

#[test]
fn colliding_stamps_move_into_the_longer_step_before_them_when_none_is_after() {
    let mut raw = stream(100);
    raw[49].header = raw[50].header;
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::Restamped), 1);
    assert_eq!(out[49].stamp, Nanos(T0 + 49 * STEP));
    assert_eq!(out[50].stamp, Nanos(T0 + 50 * STEP));
    assert_eq!(report.gaps.count, 0);
}

pub(super) const KINDS: [SampleKind; 3] = [
    SampleKind::Rate,
    SampleKind::Average,
    SampleKind::DeltaAngle,
];

#[test]
fn a_sample_too_many_is_dropped_and_said_whatever_it_means() {
    let mut raw = stream(100);
    raw.insert(50, at(T0 + 49 * STEP, 1000));
    for k in KINDS {
        let (out, report) = run(&kind(k), &raw);
        assert_eq!(report.counts.get(Verdict::DuplicateStamp), 1, "{k:?}");
        assert_eq!(report.counts.lost(), 1, "{k:?}");
        assert_eq!(steps(&out), vec![1.0; 99], "{k:?}");
    }
}

#[test]
fn batches_that_carry_one_stamp_are_spread_evenly() {
    // Eight samples to a USB packet, all stamped when the packet came.
    let raw: Vec<RawSample> = (0..400).map(|n| at(T0 + (n / 8) * 8 * STEP, n)).collect();
    for k in [
        SampleKind::Rate,
        SampleKind::Average,
        SampleKind::DeltaAngle,
    ] {
        let (out, report) = run(&kind(k), &raw);
        assert_eq!(report.counts.lost(), 0);
        assert_eq!(report.gaps.count, 0);
        assert_eq!(steps(&out), vec![1.0; 399], "{k:?}");
        assert!(out[1..].iter().all(|s| s.join == Join::Continuous));
    }
}

#[test]
fn a_delta_angle_loses_the_bias_of_its_own_interval() {
    let bias = Vector3::new(0.1, -0.2, 0.3);
    let mut raw = stream(100);
    raw[50].interval_nanos = Some(STEP / 2);
    raw.remove(70);
    let settings = Settings {
        bias: BodyRate(bias),
        ..kind(SampleKind::DeltaAngle)
    };
    let (out, _) = run(&settings, &raw);
    for (i, (r, s)) in raw.iter().zip(&out).enumerate() {
        let secs = if i == 50 { 0.0025 } else { 0.005 };
        let expected = Vector3::from(r.gyro.unwrap()) - bias * secs;
        assert!((s.gyro.as_vector() - expected).norm() < 1e-16, "{i}");
    }
}

#[test]
fn an_overtaken_sample_that_comes_twice_is_put_back_once() {
    let mut raw = stream(100);
    let overtaken = raw.remove(50);
    raw.insert(52, overtaken);
    raw.insert(53, overtaken);
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::Repeated), 1);
    assert_eq!(report.counts.get(Verdict::Reordered), 1);
    assert_eq!(steps(&out), vec![1.0; 99]);
}

#[test]
fn a_batch_sent_again_after_long_is_late_and_no_clock_set_back() {
    let mut raw = stream(3000);
    let again: Vec<RawSample> = raw[1000..1006].to_vec();
    raw.splice(2500..2500, again);
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::Late), 6);
    assert_eq!(report.gaps.jumps_back, 0);
    assert_eq!(out.len(), 3000);
    assert!(out.iter().all(|s| s.join != Join::Hold));
}

#[test]
fn data_sent_twice_is_dropped_and_not_a_loss() {
    let mut raw = stream(200);
    // Ten samples come again, in one batch, somewhat later.
    let again: Vec<RawSample> = raw[100..110].to_vec();
    raw.splice(120..120, again);
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::Repeated), 10);
    assert_eq!(report.counts.lost(), 0);
    assert_eq!(report.gaps.count, 0);
    assert_eq!(out, run(&Settings::default(), &stream(200)).0);
}

#[test]
fn a_sample_overtaken_within_the_window_is_put_back_and_beyond_it_is_late() {
    for (places, verdict) in [
        (1, Verdict::Reordered),
        (15, Verdict::Reordered),
        (17, Verdict::Late),
        (60, Verdict::Late),
    ] {
        let mut raw = stream(200);
        let overtaken = raw.remove(100);
        raw.insert(100 + places, overtaken);
        let (out, report) = run(&Settings::default(), &raw);
        assert_eq!(report.counts.get(verdict), 1, "{places} places");
        assert_eq!(out.len(), if verdict.is_used() { 200 } else { 199 });
        assert_eq!(report.gaps.jumps_back, 0);
        assert!(out.is_sorted_by_key(|s| s.stamp));
        let flagged = out.iter().filter(|s| s.status.has(Status::REORDERED));
        assert_eq!(flagged.count(), usize::from(verdict.is_used()));
    }
}

#[test]
fn two_swapped_packets_are_put_back() {
    let mut raw = stream(200);
    raw[100..108].rotate_left(4);
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::Reordered), 4);
    assert_eq!(report.gaps.jumps_back, 0);
    assert!(out.is_sorted_by_key(|s| s.stamp));
    assert_eq!(out.len(), 200);

    // The same, and the last of the late packet has collided with the newest stamp.
    raw.insert(108, at(T0 + 107 * STEP, 1000));
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.gaps.jumps_back, 0);
    assert_eq!(report.counts.get(Verdict::Reordered), 4);
    assert!(out.is_sorted_by_key(|s| s.stamp));
}

/// Settings by which stamps are taken as they are, whatever the time of the log says.
fn as_recorded() -> Settings {
    Settings {
        repair: StampRepair::AsRecorded,
        ..Settings::default()
    }
}

/// The clock of samples from `from` on is set by `by` nanoseconds.
fn set_clock(raw: &mut [RawSample], from: usize, by: i64) {
    for r in &mut raw[from..] {
        r.header = r.header.map(|h| Nanos(h.0 + by));
    }
}

#[test]
fn a_clock_set_back_is_held_and_costs_one_interval() {
    // From six years to four samples; on the grid of stamps, and off it.
    for back in [
        200_000_000_000_000_000,
        1_000_000_000,
        100 * STEP,
        50 * STEP + 1_700_000,
        10 * STEP,
        4 * STEP + STEP / 2,
        4 * STEP,
    ] {
        for window in [Settings::REPLAY_WINDOW, Settings::LIVE_WINDOW] {
            let mut raw = stream(300);
            set_clock(&mut raw, 150, -back);
            let settings = Settings {
                reorder_window: window,
                ..as_recorded()
            };
            let (out, report) = run(&settings, &raw);
            assert_eq!(report.gaps.jumps_back, 1, "back {back}, window {window}");
            assert_eq!(report.counts.lost(), 0, "back {back}, window {window}");
            assert_eq!(out.len(), 300);
            let held: Vec<usize> = (0..300).filter(|i| out[*i].join == Join::Hold).collect();
            assert_eq!(held, [150], "back {back}, window {window}");
            assert!(out[150].status.has(Status::HELD));
            // In the order in which they were made, which is that of arrival.
            assert!(out.iter().map(|s| s.gyro.as_vector().x).is_sorted());
        }
    }
}

#[test]
fn a_clock_set_back_resets_when_asked() {
    let mut raw = stream(300);
    set_clock(&mut raw, 150, -1_000_000_000);
    let settings = Settings {
        on_gap: OnGap::Reset,
        ..as_recorded()
    };
    let (out, _) = run(&settings, &raw);
    assert_eq!(out[150].join, Join::Reset);
    assert!(out[150].status.has(Status::RESET));
}

#[test]
fn a_clock_set_forward_is_held_and_nothing_is_lost() {
    let mut raw = stream(300);
    set_clock(&mut raw, 150, 200_000_000_000_000_000);
    let (out, report) = run(&as_recorded(), &raw);
    assert_eq!(out.len(), 300);
    assert_eq!(out[150].join, Join::Hold);
    assert_eq!(report.gaps.count, 1);
    assert_eq!(report.gaps.not_bridged, 1);
}

#[test]
fn one_stray_stamp_far_ahead_costs_one_sample() {
    let mut raw = stream(300);
    raw[150].header = Some(Nanos(T0 + 1_000_000_000_000));
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::StrayStamp), 1);
    assert_eq!(report.first_bad(Verdict::StrayStamp).unwrap().index, 150);
    assert_eq!(out.len(), 299);
    assert!(out.iter().all(|s| s.join != Join::Hold));
    assert_eq!(report.gaps.missing, 1);
}

#[test]
fn gaps_up_to_the_limit_are_bridged_and_beyond_it_follow_the_policy() {
    for (on_gap, join, status) in [
        (OnGap::Hold, Join::Hold, Status::HELD),
        (OnGap::Bridge, Join::Bridge, Status::BRIDGED),
        (OnGap::Reset, Join::Reset, Status::RESET),
    ] {
        let settings = Settings {
            on_gap,
            ..Settings::default()
        };
        // A hundred steps are the 0.5 s of the limit.
        for (gone, expected) in [(1, Join::Bridge), (99, Join::Bridge), (100, join)] {
            let mut raw = stream(400);
            raw.drain(200..200 + gone);
            let (out, report) = run(&settings, &raw);
            assert_eq!(out[200].join, expected, "{on_gap:?} {gone}");
            let gap = report.gaps.kept[0];
            assert_eq!(report.gaps.count, 1);
            assert_eq!(gap.missing, gone as u64);
            assert_eq!(gap.start, out[199].stamp);
            assert_eq!(gap.length_nanos, (gone as i64 + 1) * STEP);
            // The faster edge: sample 200 + gone.
            let rate = Vector3::new((200 + gone) as f64 * 1e-3, 0.5, -0.25).norm();
            let bound = rate * (gone + 1) as f64 * 0.005;
            assert!((gap.rotation_bound - bound).abs() < 1e-12);
            if gone == 100 {
                assert!(out[200].status.has(status));
            }
        }
    }
}

#[test]
fn a_late_stamp_that_is_caught_up_with_is_no_gap() {
    for k in [
        SampleKind::Rate,
        SampleKind::Average,
        SampleKind::DeltaAngle,
    ] {
        // A burst: five stamps late, the last of them by nothing.
        let mut raw = stream(100);
        for (i, late) in [(50, 4.0), (51, 3.2), (52, 2.4), (53, 1.6), (54, 0.8)] {
            raw[i].header = Some(Nanos(T0 + i as i64 * STEP + (late * STEP as f64) as i64));
        }
        let (out, report) = run(&kind(k), &raw);
        assert_eq!(report.gaps.count, 0, "{k:?}");
        assert!(out[1..].iter().all(|s| s.join == Join::Continuous));
        if k != SampleKind::Rate {
            // Contiguous: no hole for anyone to fill a second time.
            assert!(out.windows(2).all(|w| w[1].start == w[0].stamp));
        }
    }
}

#[test]
fn an_increment_behind_missing_samples_covers_its_own_interval_only() {
    for k in [SampleKind::Average, SampleKind::DeltaAngle] {
        let mut raw = stream(100);
        raw.drain(50..53);
        let (out, report) = run(&kind(k), &raw);
        assert_eq!(out[50].join, Join::Bridge);
        assert_eq!(out[50].start.0, out[50].stamp.0 - STEP, "{k:?}");
        let gap = report.gaps.kept[0];
        assert_eq!((gap.missing, gap.length_nanos), (3, 3 * STEP));
        let expected = match k {
            SampleKind::DeltaAngle | SampleKind::Rotation => 0.5,
            _ => 0.5 * 0.005,
        };
        assert!((out[50].gyro.as_vector().y - expected).abs() < 1e-15);
    }
}

#[test]
fn the_first_increment_of_a_recording_knows_its_interval_though_the_first_step_is_a_gap() {
    // As in the gait recording, whose samples 1 and 2 are missing.
    let mut raw = stream(100);
    raw.drain(1..3);
    for window in [16, 4] {
        let settings = Settings {
            reorder_window: window,
            ..kind(SampleKind::Average)
        };
        let (out, report) = run(&settings, &raw);
        assert_eq!(out[0].start.0, out[0].stamp.0 - STEP);
        assert_eq!(out[1].join, Join::Bridge);
        assert_eq!(out[1].start.0, out[1].stamp.0 - STEP);
        assert_eq!(report.gaps.missing, 2);
    }
}

#[test]
fn a_stated_interval_is_what_the_angle_is_made_of() {
    let own = STEP + 3_000;
    let mut raw: Vec<RawSample> = stream(100)
        .into_iter()
        .map(|r| RawSample {
            interval_nanos: Some(own),
            ..r
        })
        .collect();
    // Stamps jitter by up to a fifth of a step: still contiguous.
    for (i, r) in raw.iter_mut().enumerate() {
        let jitter = (i as i64 * 7919 % 2001 - 1000) * 1000;
        r.header = r.header.map(|h| Nanos(h.0 + jitter));
    }
    let bias = Vector3::new(0.01, 0.02, 0.03);
    let settings = Settings {
        bias: BodyRate(bias),
        ..kind(SampleKind::Average)
    };
    let (out, report) = run(&settings, &raw);
    assert_eq!(report.gaps.count, 0);
    for (i, w) in out.windows(2).enumerate() {
        assert_eq!(w[1].start, w[0].stamp);
        let expected = (Vector3::from(raw[i + 1].gyro.unwrap()) - bias) * (own as f64 * 1e-9);
        assert!((w[1].gyro.as_vector() - expected).norm() < 1e-17);
    }
    // Half of them lost: a hole before every one, as long as an interval.
    let thinned: Vec<RawSample> = raw.into_iter().step_by(2).collect();
    let (out, report) = run(&settings, &thinned);
    assert_eq!(report.gaps.missing, 49);
    assert!(out[1..].iter().all(|s| s.join == Join::Bridge));
    assert!(out.iter().all(|s| s.stamp.since(s.start) == own));
}

#[test]
fn bias_is_subtracted_in_body_axes_after_units_axes_and_mounting() {
    // Two different quarter turns, so that an order swap or a transpose shows.
    let axes = "YxZ".parse().unwrap();
    let quarter =
        *Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2).matrix();
    let mount = Dcm::assume(quarter);
    let bias = Vector3::new(0.1, 0.2, 0.3);
    let mut raw = sample(0);
    raw.gyro = Some([1000.0, 2000.0, 4000.0]);
    raw.accel = Some([1.0, 2.0, 4.0]);
    let settings = Settings {
        unit: GyroUnit::Mrad,
        axes,
        mount,
        bias: BodyRate(bias),
        ..Settings::default()
    };
    let (out, _) = run(&settings, &[raw]);
    // axes: (1, 2, 4) -> (2, -1, 4); a quarter turn about x: (x, y, z) -> (x, -z, y).
    let expected = Vector3::new(2.0, -4.0, -1.0) - bias;
    assert!((out[0].gyro.as_vector() - expected).norm() < 1e-12);
    assert!((out[0].accel.unwrap().as_vector() - Vector3::new(2.0, -4.0, -1.0)).norm() < 1e-12);

    let (out, _) = run(
        &Settings {
            unit: GyroUnit::Deg,
            ..Settings::default()
        },
        &[RawSample {
            gyro: Some([180.0, -90.0, 0.0]),
            ..sample(0)
        }],
    );
    let pi = std::f64::consts::PI;
    assert!((out[0].gyro.as_vector() - Vector3::new(pi, -pi / 2.0, 0.0)).norm() < 1e-15);
}

#[test]
fn what_needs_no_mapping_keeps_its_bits() {
    let mut raw = stream(50);
    raw[7].gyro = Some([-0.0, 5e-324, 1e-300]);
    // Amid a steady rotation it is a spike.
    let settings = Settings {
        spikes: SpikePolicy::Keep,
        ..Settings::default()
    };
    let (out, _) = run(&settings, &raw);
    for (r, s) in raw.iter().zip(&out) {
        // -0.0 - 0.0 is -0.0, so even the sign of zero is kept.
        let bits = |v: [f64; 3]| v.map(f64::to_bits);
        assert_eq!(bits(r.gyro.unwrap()), bits((*s.gyro.as_vector()).into()));
        assert_eq!(
            bits(r.accel.unwrap()),
            bits((*s.accel.unwrap().as_vector()).into())
        );
    }
}

#[test]
fn each_bad_value_gets_its_verdict_and_the_next_sample_says_so() {
    for (gyro, verdict, k) in [
        (None, Verdict::NoGyro, SampleKind::Rate),
        (
            Some([f64::NAN, 0.0, 0.0]),
            Verdict::NotFinite,
            SampleKind::Rate,
        ),
        (
            Some([0.0, 0.0, f64::NEG_INFINITY]),
            Verdict::NotFinite,
            SampleKind::Rate,
        ),
        (Some([0.0, -40_001.0, 0.0]), Verdict::Huge, SampleKind::Rate),
        (
            Some([0.0, -40_001.0, 0.0]),
            Verdict::Huge,
            SampleKind::Average,
        ),
        (
            Some([1001.0, 0.0, 0.0]),
            Verdict::Huge,
            SampleKind::DeltaAngle,
        ),
    ] {
        let mut raw = stream(100);
        raw[50].gyro = gyro;
        let (out, report) = run(&kind(k), &raw);
        assert_eq!(report.counts.get(verdict), 1);
        assert_eq!(report.first_bad(verdict).unwrap().index, 50);
        assert_eq!(report.counts.lost(), 1);
        assert_eq!(out.len(), 99);
        assert!(out[50].status.has(Status::REJECTED_BEFORE));
        assert_eq!(out[50].join, Join::Bridge);
        assert!(!out[51].status.has(Status::REJECTED_BEFORE));
    }
}

#[test]
fn a_bad_acceleration_costs_the_acceleration_alone() {
    let mut raw = stream(100);
    raw[50].accel = Some([0.0, f64::NAN, 9.8]);
    raw[51].accel = None;
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(out.len(), 100);
    assert_eq!((out[50].accel, out[51].accel), (None, None));
    assert_eq!(report.accel_dropped, 1);
    assert_eq!(report.counts.lost(), 0);
}

#[test]
fn a_zero_stamp_is_no_stamp_unless_the_clock_begins_there() {
    for place in [0, 1, 50] {
        let mut raw = stream(100);
        raw[place].header = Some(Nanos(0));
        let (out, report) = run(&Settings::default(), &raw);
        assert_eq!(report.counts.get(Verdict::NoStamp), 1, "{place}");
        assert_eq!(out.len(), 99);
        assert_eq!(report.gaps.jumps_back, 0);
    }
    let raw: Vec<RawSample> = (0..100).map(|n| at(n * STEP, n)).collect();
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(out.len(), 100);
    assert_eq!(report.counts.lost(), 0);
    assert_eq!(out[0].stamp, Nanos(0));

    // A simulation started again: its clock is set back to zero.
    let twice: Vec<RawSample> = raw.iter().chain(&raw).copied().collect();
    let (out, report) = run(&Settings::default(), &twice);
    assert_eq!((report.counts.lost(), report.gaps.jumps_back), (0, 0));
    // (The very same data again is a repeat; other data is a new run.)
    assert_eq!(out.len(), 100);
    let again: Vec<RawSample> = (0..100).map(|n| at(n * STEP, n + 100)).collect();
    let twice: Vec<RawSample> = raw.into_iter().chain(again).collect();
    let (out, report) = run(&Settings::default(), &twice);
    assert_eq!((report.counts.lost(), report.gaps.jumps_back), (0, 1));
    assert_eq!(out.len(), 200);
}

#[test]
fn the_index_clock_gives_lost_payloads_their_time() {
    let settings = Settings {
        clock: Clock::Index { rate_hz: 300.0 },
        ..Settings::default()
    };
    let mut conditioner = Conditioner::new(&settings).unwrap();
    let mut out = Vec::new();
    conditioner.push(&stream(100), &mut out);
    conditioner.push_undecodable(3);
    conditioner.push(&stream(100), &mut out);
    conditioner.finish(&mut out);
    assert_eq!(out.len(), 200);
    let base = T0 + 1_000_000;
    for (i, s) in out.iter().enumerate() {
        let n = if i < 100 { i } else { i + 3 };
        // Rounded to whole nanoseconds, without error growing with n.
        let exact = base as i128 + (n as i128 * 10_000_000 + 1) / 3;
        assert_eq!(i128::from(s.stamp.0), exact, "{n}");
    }
    let report = conditioner.report();
    assert_eq!(report.counts.get(Verdict::Undecodable), 3);
    assert_eq!(report.gaps.missing, 3);
    assert!(out[100].status.has(Status::REJECTED_BEFORE));
}

#[test]
fn the_clock_falls_back_to_log_time_and_says_why() {
    let with = |f: fn(i64) -> Option<Nanos>| -> Vec<RawSample> {
        (0..50)
            .map(|n| RawSample {
                header: f(n),
                ..sample(n)
            })
            .collect()
    };
    let good = stream(50);
    assert_eq!(choose_clock(&good, Clock::Header), (Clock::Header, None));
    assert_eq!(choose_clock(&[], Clock::Header), (Clock::Header, None));
    let (clock, warning) = choose_clock(&with(|_| Some(Nanos(0))), Clock::Header);
    assert_eq!(clock, Clock::Log);
    assert!(matches!(
        warning,
        Some(ClockWarning::Zero { looked_at: 50, .. })
    ));
    assert!(warning.unwrap().to_string().contains("rate_hz"));
    let (clock, warning) = choose_clock(&with(|_| None), Clock::Header);
    assert_eq!(clock, Clock::Log);
    assert!(matches!(warning, Some(ClockWarning::Absent { .. })));
    let (clock, warning) = choose_clock(&with(|_| Some(Nanos(T0))), Clock::Header);
    assert_eq!(clock, Clock::Log);
    assert!(matches!(warning, Some(ClockWarning::StandsStill { .. })));
    let mixed = with(|n| Some(Nanos(if n == 7 { T0 } else { 0 })));
    assert_eq!(choose_clock(&mixed, Clock::Header), (Clock::Header, None));
    let stuck: Vec<RawSample> = (0..50)
        .map(|_| RawSample {
            header: None,
            log: Nanos(T0),
            ..sample(0)
        })
        .collect();
    let (_, warning) = choose_clock(&stuck, Clock::Header);
    assert_eq!(warning, Some(ClockWarning::NoneMoves));
}

#[test]
fn trimming_counts_from_the_first_stamp_and_is_no_loss() {
    let settings = Settings {
        start: Some(0.1),
        until: Some(0.3),
        ..Settings::default()
    };
    let mut raw = stream(100);
    raw[1].gyro = Some([f64::NAN; 3]);
    let (out, report) = run(&settings, &raw);
    // 0.1 s is sample 20, 0.3 s sample 60, both inside.
    assert_eq!(out.len(), 41);
    assert_eq!(out[0].stamp, Nanos(T0 + 20 * STEP));
    assert_eq!(report.counts.get(Verdict::Trimmed), 59);
    assert_eq!(report.counts.lost(), 0);
}

#[test]
fn live_every_sample_leaves_at_once_but_one_that_shares_its_stamp() {
    let settings = Settings {
        reorder_window: Settings::LIVE_WINDOW,
        ..Settings::default()
    };
    let mut conditioner = Conditioner::new(&settings).unwrap();
    let mut raw = stream(100);
    raw[51].header = raw[50].header;
    for (i, r) in raw.iter().enumerate() {
        let mut out = Vec::new();
        conditioner.push(std::slice::from_ref(r), &mut out);
        let expected: &[i64] = match i {
            51 => &[],
            52 => &[51, 52],
            _ => &[i as i64],
        };
        let stamps: Vec<Nanos> = out.iter().map(|s| s.stamp).collect();
        let expected: Vec<Nanos> = expected.iter().map(|n| Nanos(T0 + n * STEP)).collect();
        assert_eq!(stamps, expected, "sample {i}");
    }
}

#[test]
fn live_the_first_increment_waits_for_the_second_to_know_its_interval() {
    let settings = Settings {
        reorder_window: Settings::LIVE_WINDOW,
        ..kind(SampleKind::Average)
    };
    let mut conditioner = Conditioner::new(&settings).unwrap();
    let mut out = Vec::new();
    for (n, ready) in [(0, 0), (1, 2), (2, 3), (3, 4)] {
        conditioner.push(&[sample(n)], &mut out);
        assert_eq!(out.len(), ready);
    }
    assert!(out.iter().all(|s| s.stamp.since(s.start) == STEP));
}

#[test]
fn lists_and_buffers_stay_bounded_whatever_comes() {
    // A clock that stands still for 50,000 different samples, a stream running backwards, and 3000 gaps.
    let stuck: Vec<RawSample> = (0..50_000).map(|n| at(T0, n)).collect();
    let mut conditioner = Conditioner::new(&kind(SampleKind::DeltaAngle)).unwrap();
    let mut out = Vec::new();
    conditioner.push(&stuck, &mut out);
    // A second of an 8 kHz gyro is kept, the rest is turned away.
    assert!(conditioner.report().counts.get(Verdict::DuplicateStamp) > 41_000);
    let backwards: Vec<RawSample> = (0..50_000).rev().map(sample).collect();
    conditioner.push(&backwards, &mut out);
    let gappy: Vec<RawSample> = (0..9000)
        .filter(|n| n % 3 != 0 && n % 30 != 1)
        .map(|n| at(2 * T0 + n * STEP, n))
        .collect();
    conditioner.push(&gappy, &mut out);
    conditioner.finish(&mut out);
    let report = conditioner.report();
    assert_eq!(report.counts.total(), 100_000 + gappy.len() as u64);
    assert!(report.gaps.count > 2000);
    assert_eq!(report.gaps.kept.len(), GAPS_KEPT);
}

#[test]
fn settings_that_can_not_be_name_their_flag() {
    let nan = f64::NAN;
    let cases: [(&str, Settings); 7] = [
        (
            "mount",
            Settings {
                mount: Dcm::assume(-Matrix3::identity()),
                ..Settings::default()
            },
        ),
        (
            "mount",
            Settings {
                mount: Dcm::assume(Matrix3::from_element(nan)),
                ..Settings::default()
            },
        ),
        (
            "rate_hz",
            Settings {
                clock: Clock::Index { rate_hz: 0.0 },
                ..Settings::default()
            },
        ),
        (
            "max_gap",
            Settings {
                max_gap_secs: nan,
                ..Settings::default()
            },
        ),
        (
            "bias",
            Settings {
                bias: BodyRate(Vector3::new(0.0, nan, 0.0)),
                ..Settings::default()
            },
        ),
        (
            "gyro_range",
            Settings {
                gyro_range: Some(-1.0),
                ..Settings::default()
            },
        ),
        (
            "start",
            Settings {
                start: Some(3.0),
                until: Some(2.0),
                ..Settings::default()
            },
        ),
    ];
    for (flag, settings) in cases {
        let error = Conditioner::new(&settings).unwrap_err().to_string();
        assert!(error.contains(flag), "{flag}: {error}");
    }
}
