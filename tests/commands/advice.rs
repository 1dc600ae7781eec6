//! Promise: where something fails the message says what helps, and a mounting is said in angles as well as in numbers.

use crate::program::strapd;
use crate::replays::fixture;

#[test]
fn a_mounting_in_angles_is_that_of_its_quaternion_and_is_in_the_summary() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("constant_rate.mcap").display().to_string();
    let run = |mount: &str, out: &str| {
        let ran = strapd(
            dir.path(),
            &format!("replay {log} --mount {mount} -o {out}"),
        );
        assert!(
            ran.done().out.contains("--mount rpy=0,0,90.00"),
            "{}",
            ran.out
        );
        std::fs::read_to_string(dir.path().join(out)).unwrap()
    };
    let half = std::f64::consts::FRAC_PI_4;
    let angles = run("rpy=0,0,90", "a.csv");
    let numbers = run(&format!("q={},0,0,{}", half.cos(), half.sin()), "b.csv");
    let last = |text: &str| -> Vec<f64> {
        let row = text.lines().last().unwrap().to_owned();
        row.split(',')
            .filter_map(|cell| cell.parse().ok())
            .collect()
    };
    let (angles, numbers) = (last(&angles), last(&numbers));
    assert!(angles.len() == numbers.len() && angles.len() > 5);
    for (a, b) in angles.iter().zip(&numbers) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} {b}");
    }
}

#[test]
fn what_fails_says_what_helps() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = fixture("constant_rate.mcap").display().to_string();
    // A port that nobody has: it was free a moment ago.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = free.local_addr().unwrap();
    drop(free);
    strapd(at, &format!("send {log} tcp://{address}"))
        .refused(1, &["refused", "is `strapd serve` running there?"]);
    strapd(at, &format!("report {log} -o x.pdf"))
        .refused(2, &["a report is HTML", "-o report.html"]);
    std::fs::write(at.join("a.txt"), "1700000000 0.1 0.2 0.3\n").unwrap();
    strapd(at, "info a.txt").refused(
        1,
        &["a.txt", "the first line names the columns, or --columns"],
    );
}

/// Several simulations go into one daemon, and their lines into one file.
#[test]
fn a_simulated_sensor_has_the_id_it_is_given_and_its_truth_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(at, "simulate coning --duration 1 --id left -o a.ndjson -q").done();
    let text = std::fs::read_to_string(at.join("a.ndjson")).unwrap();
    for (id, class) in [("left", "RATE"), ("left truth", "ATT")] {
        let found = text.lines().filter(|line| {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            line["id"] == id && line["class"] == class
        });
        assert!(found.count() > 100, "{id}");
    }
    // Its truth is a reference as any other simulation's.
    let replay = "replay a.ndjson --against-recorded -o out.ndjson";
    let ran = strapd(at, replay);
    assert!(ran.done().out.contains("within 3 sigma"), "{ran:?}");
    strapd(at, "compare out.ndjson a.ndjson").done();
    for (flags, says) in [
        ("--id x -o tcp://127.0.0.1:9?id=y", "one sensor has one id"),
        ("-o tcp://127.0.0.1:9?id=", "1 to 255 bytes"),
        (
            "-o tcp://127.0.0.1:9?id=a%20truth",
            "the truth is called so",
        ),
        (
            "-o tcp://127.0.0.1:9?id=a&id=b",
            "nothing follows the address",
        ),
    ] {
        let ran = strapd(at, &format!("simulate coning --duration 1 {flags}"));
        assert!(ran.code == Some(2) && ran.err.contains(says), "{ran:?}");
    }
}

/// Trajectory as evo and the TUM benchmark write it: numbers alone.
#[test]
fn a_trajectory_without_a_heading_is_read_by_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let recording = fixture("ximu3.mcap");
    let recording = recording.display();
    strapd(at, &format!("replay {recording} -o own.tum -q")).done();
    let own = std::fs::read_to_string(at.join("own.tum")).unwrap();
    let bare: String = own
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(bare.len() < own.len());
    std::fs::write(at.join("evo.tum"), &bare).unwrap();
    for [a, b] in [["evo.tum", "own.tum"], ["own.tum", "evo.tum"]] {
        let ran = strapd(at, &format!("compare {a} {b} --max-angle 1e-9"));
        assert!(ran.done().out.contains("matched  500 "), "{ran:?}");
    }
    // Another name says nothing of its columns.
    std::fs::write(at.join("evo.dat"), &bare).unwrap();
    let ran = strapd(at, "compare evo.dat own.tum");
    ran.refused(1, &["evo.dat", "--columns"]);
}

#[test]
fn the_help_of_columns_names_every_role_that_there_is() {
    let dir = tempfile::tempdir().unwrap();
    let refused = strapd(dir.path(), "info x.csv --columns nothing=1").err;
    let (_, roles) = refused.split_once("they are ").unwrap();
    let help = strapd(dir.path(), "replay --help").out;
    let (_, of_columns) = help.split_once("--columns <").unwrap();
    let of_columns = of_columns.get(..700).unwrap();
    let roles: Vec<&str> = roles.lines().next().unwrap().split(", ").collect();
    assert!(roles.len() >= 10, "{refused}");
    for role in roles {
        let has = of_columns.split(|c: char| !c.is_alphanumeric());
        assert!(
            has.into_iter().any(|word| word == role.trim()),
            "{role}: {of_columns}"
        );
    }
}

#[test]
fn a_wrong_letter_in_a_name_and_a_recording_in_place_of_an_attitude_are_helped() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let table = "time,gyro_x,gyro_y,gyro_z\n0.00,0.1,0,0\n0.01,0.1,0,0\n0.02,0.1,0,0\n";
    std::fs::write(at.join("thigh.csv"), table.replace("\\\n", "\n")).unwrap();
    for command in [
        "replay thihg.csv -o x.mcap",
        "info thig.csv",
        "check Thigh.csv",
    ] {
        strapd(at, command).refused(1, &["cannot open", "there is thigh.csv"]);
    }
    let ran = strapd(at, "replay shank.csv -o x.mcap");
    assert!(
        ran.code == Some(1) && !ran.err.contains("there is"),
        "{ran:?}"
    );
    std::fs::create_dir(at.join("logs")).unwrap();
    std::fs::write(at.join("logs/shank_left.csv"), table).unwrap();
    let ran = strapd(at, "info logs/shank_lefft.csv");
    ran.refused(1, &["there is logs/shank_left.csv"]);
    for command in [
        "compare thigh.csv thigh.csv",
        "relative thigh.csv thigh.csv -o x.csv",
    ] {
        let ran = strapd(at, command);
        for says in [
            "holds no attitude",
            "strapd replay thigh.csv -o attitude.mcap",
        ] {
            assert!(ran.code == Some(1) && ran.err.contains(says), "{ran:?}");
        }
    }
}
