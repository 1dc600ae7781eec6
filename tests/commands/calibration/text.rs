//! The text of a calibration: written, read, written the same; and what is none.

use strapd::config::calibration::{parse, text_of};
use strapd_attitude::estimate::{CalibrationTerm, SensorCalibration};

/// Small multiples of it have no more than the nine digits that are written: 2^-12.
const STEP: f64 = 0.000_244_140_625;

fn full() -> SensorCalibration {
    let known = |value| CalibrationTerm {
        value,
        sigma: Some([1e-3, 2e-3, 3e-3]),
        observed: [true, false, true],
    };
    let matrix = |scale: f64| {
        let mut value = [0.0; 9];
        for (i, v) in value.iter_mut().enumerate() {
            *v = scale * (i as f64 - 4.0);
        }
        CalibrationTerm {
            value,
            sigma: Some([2.5e-4; 9]),
            observed: [true; 9],
        }
    };
    let one = |value| CalibrationTerm {
        value: [value],
        sigma: None,
        observed: [true],
    };
    SensorCalibration {
        sensor: Some("/imu \"left\"\n".to_owned()),
        date: Some("2026-11-22T20:52:07Z".to_owned()),
        sources: vec!["a.mcap".to_owned(), "b\\c".to_owned()],
        bias: Some(known([0.01, -0.008, 5e-9])),
        gyro: Some(matrix(STEP)),
        force_bias: Some(known([0.0, 1.0, -2.0])),
        force: Some(matrix(-STEP)),
        lead: Some(one(2.3e-3)),
        hard_iron: Some(known([2e-6, 0.0, -1e-6])),
        soft_iron: Some(matrix(2.0 * STEP)),
        field_lead: Some(one(-1e-3)),
        truncation_step: Some(one(1.065_264e-3)),
    }
}

#[test]
fn what_is_written_is_read_and_written_the_same() {
    for known in [full(), SensorCalibration::default()] {
        let text = text_of(&known);
        let read = parse(&text).unwrap();
        assert_eq!(read, known, "{text}");
        assert_eq!(text_of(&read), text);
    }
}

#[test]
fn a_number_alone_is_a_value_without_sigma() {
    let known = parse(
        "bias = [0.01, 0, -1e-3]\ntruncation_step = 0.001\n[lead]\nvalue = 0.002\nsigma = 1e-4",
    )
    .unwrap();
    assert_eq!(known.bias.unwrap().value, [0.01, 0.0, -1e-3]);
    assert!(known.bias.unwrap().is_unobserved());
    assert_eq!(known.step(), Some(0.001));
    assert_eq!(known.lead.unwrap().sigma_of(0), Some(1e-4));
    let unseen = parse("[lead]\nvalue = 0.002\nsigma = 1e-4\nobserved = false").unwrap();
    assert_eq!(unseen.lead.unwrap().sigma_of(0), None);
}

#[test]
fn what_is_no_calibration_is_refused_with_line_and_key() {
    for (text, line, key) in [
        ("bias = [1, 2]", "line 1", "bias"),
        ("\n\n[bias]\nvalue = [1, 2, nan]", "line 4", "bias.value"),
        ("[bias]\nvalue = [1, 2, inf]", "line 2", "bias.value"),
        ("[bias]\nvalue = [1, 2, '3']", "line 2", "bias.value"),
        ("bais = [1, 2, 3]", "line 1", "unknown key `bais`"),
        (
            "[bias]\nvalue = [0, 0, 0]\nsgima = 1",
            "line 3",
            "bias.sgima",
        ),
        ("[bias]\nsigma = [0, 0, 0]", "line 1", "`value` is missing"),
        ("bias = [1e9, 0, 0]", "", "bias"),
        (
            "[bias]\nvalue = [0, 0, 0]\nsigma = [0, 1, 1]",
            "",
            "sigma 0",
        ),
        (
            "[bias]\nvalue = [0, 0, 0]\nsigma = [-1, 1, 1]",
            "",
            "sigma -1",
        ),
        (
            "[bias]\nvalue = [0, 0, 0]\nobserved = 1",
            "line 3",
            "bias.observed",
        ),
        ("G = [0, 0, 0]", "line 1", "G"),
        ("G = [[0, 0, 0], [0, 0], [0, 0, 0]]", "line 1", "G"),
        ("G = [[1, 0, 0], [0, 0, 0], [0, 0, 0]]", "", "G"),
        ("lead = 1e3", "", "lead"),
        ("truncation_step = 0", "", "truncation_step"),
        ("truncation_step = -1e-3", "", "truncation_step"),
        ("sources = 'a'", "line 1", "sources"),
        ("sensor = 3", "line 1", "sensor"),
        ("strapd_calibration = 2", "line 1", "strapd_calibration"),
        ("bias = [0, 0, 0]\nbias = [0, 0, 0]", "line 2", "duplicate"),
        ("bias = [0, 0", "line 1", ""),
        ("\u{0}", "line 1", ""),
    ] {
        let said = parse(text).unwrap_err();
        assert!(
            said.to_string().contains(line) && said.what().contains(key),
            "{text}: {said}"
        );
    }
    let long = format!("sensor = '{}'", "x".repeat(5000));
    assert!(parse(&long).unwrap_err().what().contains("4096"));
    let many = format!("sources = [{}]", "'a',".repeat(65));
    assert!(parse(&many).unwrap_err().what().contains("64"));
}
