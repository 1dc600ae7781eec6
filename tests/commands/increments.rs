//! Promise: who integrates in the sensor is believed: turns are multiplied as they are, and steps of time are where
//! the rows
//! lie. The truth is exact: the attitude of a cone at every instant, and the quotients of its neighbours as increments.

use crate::program::{strapd, strapd_fed};
use std::fmt::Write;
use std::path::Path;

/// Rows a second of a Movella DOT, and its step.
const STEP_US: u64 = 16_667;
const ROWS: u64 = 900;

/// The attitude of a cone of half angle 0.2 at 2 Hz: a turn about an axis in the plane that goes round.
fn cone(secs: f64) -> [f64; 4] {
    let (half, at) = (0.1_f64, std::f64::consts::TAU * 2.0 * secs);
    [
        half.cos(),
        half.sin() * at.cos(),
        half.sin() * at.sin(),
        0.0,
    ]
}

fn product([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 4] {
    [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
}

fn inverse([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}

/// Rotation from one instant to another.
fn between(from: f64, to: f64) -> [f64; 4] {
    product(inverse(cone(from)), cone(to))
}

fn secs(row: u64) -> f64 {
    (row * STEP_US) as f64 * 1e-6
}

/// An export of the increments.
fn dot() -> String {
    let mut text = "sep=,\nDeviceTag:,Movella DOT 1\nOutputRate:,60Hz\n\nPacketCounter,SampleTimeFine,dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3],Status\n".to_owned();
    for row in 1..=ROWS {
        let [w, x, y, z] = between(secs(row - 1), secs(row));
        writeln!(
            text,
            "{row},{},{w:?},{x:?},{y:?},{z:?},0,0,{:?},0",
            row * STEP_US,
            9.81 * STEP_US as f64 * 1e-6
        )
        .unwrap();
    }
    text
}

/// The attitudes of a run.
fn attitudes(at: &Path) -> Vec<[f64; 4]> {
    let text = std::fs::read_to_string(at.join("out.csv")).unwrap();
    let place = |name| {
        text.lines()
            .next()
            .unwrap()
            .split(',')
            .position(|n| n == name)
    };
    let places = ["qw", "qx", "qy", "qz"].map(|name| place(name).unwrap());
    let quaternion = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        places.map(|place| cells[place].parse().unwrap())
    };
    text.lines().skip(1).map(quaternion).collect()
}

/// The greatest angle between what a run says was turned since its first attitude, and the truth.
fn worst(found: &[[f64; 4]]) -> f64 {
    let off = found.iter().enumerate().map(|(n, q)| {
        let turned = product(inverse(found[0]), *q);
        let off = product(inverse(turned), between(secs(1), secs(n as u64 + 1)));
        let [_, x, y, z] = off;
        2.0 * (x * x + y * y + z * z).sqrt()
    });
    off.fold(0.0, f64::max)
}

#[test]
fn increments_of_the_attitude_are_multiplied_and_nothing_is_added() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::write(at.join("dot.csv"), dot()).unwrap();
    let replay = "replay dot.csv --aid none --bias none -o out.csv --force";
    let ran = strapd(at, replay);
    ran.done();
    let said = format!("{}{}", ran.out, ran.err);
    for words in [
        "dq=dq_W:dq_X:dq_Y:dq_Z",
        "a sample is the whole rotation in the interval",
        "the specific force is `dv[1]`, `dv[2]`, `dv[3]`",
    ] {
        assert!(said.contains(words), "`{words}` is missing: {said}");
    }
    let found = attitudes(at);
    assert_eq!(found.len() as u64, ROWS);
    // Rounding of 900 products; 3e-15 as measured.
    let exact = worst(&found);
    assert!(exact < 1e-13, "{exact:e} rad");
    // Taken for angles, of which the axis' motion is not in them yet, it is counted twice: a cone drifts.
    strapd(at, &format!("{replay} --sample-kind delta-angle")).done();
    let doubled = worst(&attitudes(at));
    assert!(doubled > 1e-3, "{doubled:e} rad");
    // In a pipe, and through what strapd writes of it, the bits are the same.
    strapd_fed(
        at,
        "replay - --aid none --bias none -o out.csv --force",
        dot(),
    )
    .done();
    assert_eq!(attitudes(at), found);
    let lines = strapd(at, "cat dot.csv").done().out.clone();
    assert!(
        lines.contains(r#""sample_kind":"rotation""#),
        "{lines:.300}"
    );
    strapd_fed(
        at,
        "replay - --aid none --bias none -o out.csv --force",
        lines,
    )
    .done();
    assert_eq!(attitudes(at), found);
}

#[test]
fn whole_rotations_of_a_simulated_motion_give_it_back_at_any_rate() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for rate in [20, 1000] {
        strapd(
            at,
            &format!("simulate coning --duration 20 --rate-hz {rate} --sample-kind rotation -o c.mcap --force"),
        )
        .done();
        for method in ["auto", "commit"] {
            strapd(
                at,
                &format!("replay c.mcap --sample-kind rotation --method {method} --aid none --bias none -o out.csv --force"),
            )
            .done();
            let compared = strapd(at, "compare out.csv c.mcap --json").done().json();
            let worst = compared["total"]["max_deg"].as_f64().unwrap();
            assert!(worst < 1e-9, "{rate} Hz, {method}: {worst:e} degrees");
        }
    }
}

#[test]
fn a_column_of_steps_places_the_rows_as_the_stamps_they_sum_up_to() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (mut steps, mut stamps) = ("dt_us,".to_owned(), "t_us,".to_owned());
    for text in [&mut steps, &mut stamps] {
        text.push_str("gyro_x_dps,gyro_y_dps,gyro_z_dps\n");
    }
    let mut now = 0;
    for row in 0..500_u64 {
        let step = 9_900 + (row * 7919) % 200;
        now += step;
        let turn = 30.0 * (row as f64 * 0.05).sin();
        writeln!(steps, "{step},{turn:?},5,{:?}", -turn / 2.0).unwrap();
        writeln!(stamps, "{now},{turn:?},5,{:?}", -turn / 2.0).unwrap();
    }
    let mut found = Vec::new();
    for (name, text) in [("dt.csv", &steps), ("t.csv", &stamps)] {
        std::fs::write(at.join(name), text).unwrap();
        strapd(at, &format!("replay {name} -o out.csv --force")).done();
        found.push(std::fs::read_to_string(at.join("out.csv")).unwrap());
        strapd_fed(at, "replay - -o out.csv --force", text.clone()).done();
        found.push(std::fs::read_to_string(at.join("out.csv")).unwrap());
    }
    let attitudes = |text: &str| -> Vec<String> {
        // But for the topic, which is called as its file.
        text.lines()
            .skip(1)
            .map(|row| row.rsplit_once(',').unwrap().0.to_owned())
            .collect()
    };
    for other in &found[1..] {
        assert_eq!(attitudes(&found[0]), attitudes(other));
    }
    assert_eq!(attitudes(&found[0]).len(), 500);
}
