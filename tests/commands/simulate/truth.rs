//! Simulate, replay, compare: what is found is what was.

use super::largest_error;
use crate::program::{strapd, strapd_fed};

#[test]
fn the_cusped_top_comes_back_to_two_million_millionths_of_a_degree() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(at, "simulate top --duration 1.2 -o top.mcap").done();
    strapd(at, "replay top.mcap -o est.mcap").done();
    let (error, samples) = largest_error(at, "est.mcap", "top.mcap");
    assert_eq!(samples, 2401);
    assert!(error <= 2e-12, "{error:e} deg");
    assert!(
        error > 0.0,
        "an estimate that is the truth was not estimated"
    );
    println!("top, cusped, 1.2 s: {error:e} deg");
}

#[test]
fn every_motion_comes_back_after_a_minute_through_mcap_and_lines() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // The rates at which each is well sampled; lower than the top's keeps the test short.
    for (motion, rate) in [
        ("top", 2000),
        ("rigid-body", 500),
        ("coning", 500),
        ("random", 500),
    ] {
        let flags = format!("--duration 60 --rate-hz {rate} --compression none");
        strapd(
            at,
            &format!("simulate {motion} {flags} -o {motion}.mcap -o {motion}.ndjson"),
        )
        .done();
        for (log, truth) in [("mcap", "mcap"), ("ndjson", "mcap")] {
            strapd(at, &format!("replay {motion}.{log} -o est.mcap --force")).done();
            let (error, samples) = largest_error(at, "est.mcap", &format!("{motion}.{truth}"));
            assert_eq!(samples, 60 * rate + 1, "{motion} {log}");
            assert!(error <= 1e-9, "{motion} through {log}: {error:e} deg");
            println!("{motion}, 60 s, through {log} against {truth}: {error:e} deg");
        }
    }
}

#[test]
fn averages_and_delta_angles_come_back_too() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for kind in ["average", "delta-angle"] {
        strapd(
            at,
            &format!(
                "simulate top --duration 3 --sample-kind {kind} -o a.mcap -o a.ndjson --force"
            ),
        )
        .done();
        // A line says what its sample is; an Imu message cannot.
        strapd(
            at,
            &format!("replay a.mcap --sample-kind {kind} -o m.mcap --force"),
        )
        .done();
        strapd(at, "replay a.ndjson -o n.mcap --force").done();
        for estimate in ["m.mcap", "n.mcap"] {
            let (error, samples) = largest_error(at, estimate, "a.mcap");
            assert_eq!(
                samples, 6000,
                "the interval before the start was not measured"
            );
            // 3 s at 20 turns a second: rounding of 6000 steps.
            assert!(error <= 5e-12, "{kind} {estimate}: {error:e} deg");
        }
        // Taken for the rate at its stamp, an average is half an interval late.
        strapd(at, "replay a.mcap --sample-kind rate -o wrong.mcap --force").done();
        let (error, _) = largest_error(at, "wrong.mcap", "a.mcap");
        assert!(error > 0.1, "{kind} taken for a rate: {error:e} deg");
    }
}

#[test]
fn a_pipe_of_samples_and_truth_is_replayed_and_the_truth_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let made = strapd(at, "simulate top --duration 2 -o truth.mcap -o -");
    let lines = made.done().lines();
    let of = |class: &str| lines.iter().filter(|l| l["class"] == class).count();
    assert_eq!((of("RATE"), of("ATT")), (4001, 4001));
    let replayed = strapd_fed(at, "replay - -o est.mcap --json", made.out.clone()).json();
    assert_eq!(
        replayed["topics"][0]["samples"]["total"], 4001,
        "{replayed}"
    );
    assert!(largest_error(at, "est.mcap", "truth.mcap").0 <= 3e-12);

    // Whichever comes first: here all of the truth.
    let (truth, rates): (Vec<&str>, Vec<&str>) =
        made.out.lines().partition(|l| l.contains("\"ATT\""));
    let turned = [truth, rates].concat().join("\n");
    strapd_fed(at, "replay - -o est2.mcap", turned).done();
    assert!(largest_error(at, "est2.mcap", "truth.mcap").0 <= 3e-12);
}

#[test]
fn the_truth_is_a_reference_and_never_an_estimate() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(
        at,
        "simulate coning --duration 5 --rate-hz 200 -o c.mcap -o c.ndjson -o c.csv",
    )
    .done();
    strapd(
        at,
        "replay c.mcap --method dcm-left --copy-input -o est.mcap",
    )
    .done();
    // est.mcap holds /truth as well: compared with itself it would be perfect.
    for reference in ["c.mcap", "est.mcap", "c.ndjson", "c.csv"] {
        let (error, _) = largest_error(at, "est.mcap", reference);
        assert!(error > 1e-3, "{reference}: {error:e} deg");
    }
    let (error, _) = {
        strapd(at, "replay c.mcap -o good.mcap").done();
        largest_error(at, "good.mcap", "est.mcap")
    };
    assert!(error < 1e-9, "the copied truth: {error:e} deg");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let bytes = |seed: u64, more: &str| {
        let flags = "--duration 3 --rate-hz 1000 --noise consumer_mems --jitter 0.2 --drop 0.01";
        let outputs = "-o a.mcap -o a.ndjson -o a.csv --force";
        strapd(
            at,
            &format!("simulate random {flags} --seed {seed} {outputs} {more}"),
        )
        .done();
        ["a.mcap", "a.ndjson", "a.csv"].map(|name| std::fs::read(at.join(name)).unwrap())
    };
    let first = bytes(7, "");
    assert!(first == bytes(7, ""));
    assert!(first == bytes(7, "--threads 1"));
    for (a, b) in first.iter().zip(bytes(8, "")) {
        assert!(*a != b);
    }
}

#[test]
fn steady_precession_keeps_its_tilt_from_a_case_and_from_euler_rates() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(
        at,
        "simulate top --case steady-slow --duration 20 -o s.mcap",
    )
    .done();
    strapd(at, "replay s.mcap --init first-orientation -o est.ndjson").refused(1, &["orientation"]);
    strapd(at, "replay s.mcap -o est.csv").done();
    assert!(largest_error(at, "est.csv", "s.mcap").0 < 1e-9);
    let text = strapd(
        at,
        "simulate top --euler 0,54.57,0 --euler-rates 234.4802,0,7064.0695 --duration 20 -o e.csv",
    );
    text.done();
    // The angle of the axis, from the truth beside each sample: 4.0924513 rad/s about the vertical.
    let mut reader = csv_rows(&std::fs::read_to_string(at.join("e.csv")).unwrap());
    let tilt = |[_, x, y, _]: [f64; 4], w: f64, z: f64| 2.0 * x.hypot(y).atan2(w.hypot(z));
    let angles: Vec<f64> = reader
        .drain(..)
        .map(|q| tilt(q, q[0], q[3]).to_degrees())
        .collect();
    for angle in &angles {
        // Rates given to 7 digits: nutation of some 1e-5 degree.
        assert!((angle - 54.57).abs() < 1e-3, "{angle}");
    }
    assert_eq!(angles.len(), 40_001);
}

/// Columns qw, qx, qy, qz of a table of samples.
fn csv_rows(text: &str) -> Vec<[f64; 4]> {
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let columns = ["qw", "qx", "qy", "qz"].map(at);
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            columns.map(|c| cells[c].parse().unwrap())
        })
        .collect()
}
