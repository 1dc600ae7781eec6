//! `strapd model top`.

use crate::program::{strapd, strapd_fed};
use std::path::Path;

fn here() -> &'static Path {
    Path::new(".")
}

/// The numbers of the line of a table that begins with `name`.
fn row(text: &str, name: &str) -> Vec<f64> {
    let line = text
        .lines()
        .find(|l| l.trim_start().starts_with(name))
        .unwrap_or_else(|| panic!("{name} is missing: {text}"));
    let rest = line.trim_start().strip_prefix(name).unwrap();
    rest.split(['/', ' '])
        .filter(|s| !s.is_empty())
        .map(|s| s.parse().unwrap())
        .collect()
}

#[track_caller]
fn close(found: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a / b - 1.0).abs() <= relative, "{found:?} {expected:?}");
    }
}

#[test]
fn compare_prints_the_tables_of_the_document() {
    let ran = strapd(here(), "model top --compare");
    let text = &ran.done().out;
    // Three digits against four printed ones.
    close(
        &row(text, "2000 Hz, 1.2 s"),
        &[
            17.05, 29.99, 0.0967, 0.0967, 8.79, 15.97, 1.80, 3.02, 1.83, 3.02, 0.108, 0.134,
        ],
        0.006,
    );
    close(
        &row(text, "2500 Hz, 1.45 s"),
        &[
            17.92, 34.51, 0.0778, 0.0778, 9.27, 18.20, 1.44, 2.42, 1.46, 2.42, 0.0877, 0.103,
        ],
        0.006,
    );
    // Two digits; and these numbers were found elsewhere, with other ends of the run. Orders 4 and 6.
    for (fit, expected) in [
        ("linear (2 samples)", [6.7e-2, 6.7e-2]),
        ("quadratic, causal (3)", [9.6e-4, 9.6e-4]),
        ("cubic, causal (4)", [7.1e-5, 8.0e-5]),
        ("quintic, causal (6)", [8.7e-6, 1.7e-7]),
        ("quintic, centred (6)", [8.6e-6, 3.7e-8]),
        ("7th degree, centred (8)", [8.6e-6, 8.4e-10]),
    ] {
        close(&row(text, fit)[..2], &expected, 0.08);
    }
    assert!(row(text, "auto (whole run)")[0] < 2e-12);
}

#[test]
fn requests_are_answered_one_a_line_in_order() {
    let ran = strapd_fed(
        here(),
        "model top",
        "{\"case\":\"cusped\",\"rate_hz\":2000,\"duration\":1.2,\"methods\":[\"live-right\",\"gyro-mean\",\"auto\"]}\n\
         {\"case\":\"sleeping\",\"methods\":[\"auto\"],\"duration\":0.5}\n",
    );
    let found = ran.done().lines();
    assert_eq!(found.len(), 2);
    let error = |method: &str, which: &str| found[0]["errors_deg"][method][which].as_f64().unwrap();
    close(
        &[
            error("live-right", "attitude_max"),
            error("gyro-mean", "attitude_max"),
        ],
        &[0.0967, 0.134],
        0.006,
    );
    close(&[error("gyro-mean", "axis_max")], &[0.108], 0.006);
    assert!(error("auto", "attitude_max") < 2e-12);
    for answer in &found {
        assert!(answer["energy_drift"].as_f64().unwrap() < 1e-13, "{answer}");
    }
    // A cylinder of our own: pivot inertia, arm and gravity change the motion.
    let other = strapd_fed(
        here(),
        "model top",
        "{\"case\":\"cusped\",\"methods\":[\"live-right\"],\"arm\":0.05,\"inertia\":[0.003,0.0009],\"mass\":2,\"gravity\":1.6,\"spin_hz\":25,\"tilt_deg\":30}\n",
    );
    let other = &other.done().lines()[0]["errors_deg"]["live-right"]["attitude_max"];
    assert!((other.as_f64().unwrap() - 0.0967).abs() > 0.01, "{other}");
}

#[test]
fn what_can_not_be_is_an_error_on_its_line_and_exit_3() {
    let requests = [
        ("{\"case\":\"gliding\"}", &["gliding", "cusped"] as &[&str]),
        (
            "{\"case\":\"cusped\",\"methods\":[\"magic\"]}",
            &["magic", "euler-angles", "auto"],
        ),
        // Tilt 0 with the Euler angles: singular.
        (
            "{\"case\":\"sleeping\",\"methods\":[\"euler-angles\"]}",
            &["singular", "exact method"],
        ),
        (
            "{\"case\":\"cusped\",\"tilt_deg\":0,\"methods\":[\"gyro-mean\"]}",
            &["singular"],
        ),
        (
            "{\"case\":\"cusped\",\"rate_hz\":30}",
            &["half a turn", "40.0"],
        ),
        ("{\"case\":\"cusped\",\"duration\":-1}", &["duration -1"]),
        ("{\"case\":\"cusped\",\"rate_hz\":0}", &["rate_hz 0"]),
        (
            "{\"case\":\"wavy\",\"spin_hz\":1}",
            &["no steady precession"],
        ),
        ("{\"case\":\"cusped\",\"inertia\":[1,3]}", &["no matter"]),
        (
            "{\"case\":\"cusped\",\"colour\":1}",
            &["`colour`", "rate_hz"],
        ),
    ];
    let input: String = requests.iter().map(|(r, _)| format!("{r}\n")).collect();
    let ran = strapd_fed(here(), "model top", input);
    assert_eq!(ran.code, Some(3), "{ran:?}");
    for (answer, (request, words)) in ran.lines().iter().zip(requests) {
        let error = answer["error"]
            .as_str()
            .unwrap_or_else(|| panic!("{request}: {answer}"));
        for word in words {
            assert!(
                error.contains(word),
                "{request}: `{word}` is missing: {error}"
            );
        }
    }
    assert_eq!(ran.lines().len(), 10);
}

#[test]
fn people_get_a_table_with_what_the_case_does() {
    let ran = strapd(here(), "model top --case looping");
    let text = &ran.done().out;
    for word in [
        "54.570 to 70.776 deg",
        "4.092451 and 82.615843 rad/s",
        "live-right",
        "auto",
    ] {
        assert!(text.contains(word), "`{word}` is missing: {text}");
    }
    strapd(here(), "model top --case sleeping --methods euler-angles").refused(2, &["singular"]);
    strapd(here(), "model top --case x").refused(2, &["cusped"]);
    let json = strapd(
        here(),
        "model top --case cusped --methods live-right --json",
    )
    .json();
    close(
        &[json["errors_deg"]["live-right"]["axis_max"]
            .as_f64()
            .unwrap()],
        &[0.0967],
        0.006,
    );
}
