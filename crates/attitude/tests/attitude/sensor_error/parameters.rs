//! Presets, text in data-sheet units, and what is refused.

use std::f64::consts::PI;
use strapd_attitude::noise::sensor_error::{ImuError, PRESETS, StampError, TERMS};

const DEG: f64 = PI / 180.0;

#[test]
fn every_preset_is_valid_and_has_a_source() {
    for preset in &PRESETS {
        let error = preset.error().unwrap();
        assert!(error.check().is_ok(), "{}", preset.name);
        assert_eq!(ImuError::parse(preset.name).unwrap(), error);
        assert!(preset.source.len() > 10, "{}", preset.name);
    }
}

#[test]
fn numbers_are_in_the_units_of_data_sheets() {
    // STIM300: 0.15 deg/sqrt(h) = 0.0025 deg/sqrt(s); 0.5 deg/h; 1 deg/h/g; 1 mrad.
    let error = ImuError::parse("tactical").unwrap();
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    near(error.arw, 0.0025 * DEG);
    near(error.bias_instability, 0.5 * DEG / 3600.0);
    near(error.g_sensitivity, DEG / 3600.0 / 9.80665);
    near(error.misalignment, 1e-3);
    near(error.scale, 5e-4);
    near(error.range.unwrap(), 400.0 * DEG);
    // K: 1 deg/h/sqrt(h) is 1 deg/h after an hour, 1/60 deg/h after a second.
    near(ImuError::parse("rrw=60").unwrap().rrw, DEG / 3600.0);
    near(
        ImuError::parse("rate-ramp=3600").unwrap().rate_ramp,
        DEG / 3600.0,
    );
    near(
        ImuError::parse("quantization=1").unwrap().quantization,
        4.848_136_811e-6,
    );
}

#[test]
fn text_and_sizes_are_each_others_inverse() {
    let every = TERMS
        .iter()
        .filter(|t| t.key != "lsb" && t.key != "truncation")
        .enumerate()
        .map(|(i, t)| format!("{}={}", t.key, 1.0 + i as f64 / 8.0))
        .collect::<Vec<_>>()
        .join(",");
    let error = ImuError::parse(&every).unwrap();
    let again = ImuError::parse(&error.text()).unwrap();
    for term in &TERMS {
        let (a, b) = ((term.read)(&error), (term.read)(&again));
        assert!((a - b).abs() <= 1e-6 * a.abs(), "{}: {a} {b}", term.key);
        let alone = ["lsb", "truncation"].contains(&term.key);
        assert!(alone || a > 0.0, "{}", term.key);
    }
    assert_eq!(ImuError::default().text(), "none");
    assert_eq!(ImuError::parse("none").unwrap(), ImuError::default());
}

#[test]
fn a_preset_can_be_changed_term_by_term() {
    let plain = ImuError::parse("mid").unwrap();
    let changed = ImuError::parse("mid, gm-tau=50,range=200").unwrap();
    assert_eq!(changed.gm_tau, 50.0);
    assert_eq!(changed.arw, plain.arw);
    assert!((changed.range.unwrap() - 200.0 * DEG).abs() < 1e-12);
}

#[test]
fn what_can_not_be_is_refused_by_name() {
    for (text, says) in [
        ("", "presets are none, consumer_mems"),
        ("cheap", "presets are none, consumer_mems"),
        ("arw", "no such preset"),
        ("arw=", "expected a number, deg/sqrt(h)"),
        ("arw=x", "expected a number"),
        ("arw=-1", "a number from 0 to"),
        ("arw=NaN", "a number from 0 to"),
        ("arw=inf", "a number from 0 to"),
        ("arw=1e300", "a number from 0 to"),
        ("arv=1", "terms are arw (deg/sqrt(h))"),
        ("arw=1,arw=2", "given twice"),
        ("arw=1,tactical", "expected KEY=NUMBER"),
        ("arw=1,", "expected KEY=NUMBER"),
        ("gm_sigma=1", "belong together"),
        ("gm_tau=1", "belong together"),
        ("nonlinearity_ppm=50", "give range"),
        ("quantization=1,lsb=1", "give one of them"),
        ("range=0", "nothing would come through"),
        ("bandwidth_hz=0", "nothing would come through"),
        ("bandwidth_hz=100,damping=0", "rings"),
        ("flicker_tau_min=1", "both are needed"),
        ("bandwidth_hz=1e-9", "nothing would come through"),
        ("lsb=1e-30", "is no step"),
        ("quantization=1e-30", "is no step"),
        ("flicker_tau_min=1e-12,flicker_tau_max=1", "both are needed"),
        ("flicker_tau_min=2,flicker_tau_max=1", "min < max"),
    ] {
        let refused = ImuError::parse(text).unwrap_err().to_string();
        assert!(refused.contains(says), "{text}: {refused}");
    }
}

#[test]
fn stamps_that_can_not_be_are_refused_by_name() {
    let fault = |change: fn(&mut StampError)| {
        let mut error = StampError::default();
        change(&mut error);
        error.check().unwrap_err().to_string()
    };
    assert!(fault(|e| e.sampling_jitter = 0.5).contains("sampling_jitter"));
    assert!(fault(|e| e.stamp_jitter = -1.0).contains("stamp_jitter"));
    assert!(fault(|e| e.drift_ppm = f64::NAN).contains("drift_ppm"));
    assert!(fault(|e| e.drop_probability = 1.0).contains("drop_probability"));
    assert!(fault(|e| e.burst_length = 0.5).contains("burst_length"));
    // Nine of ten lost in single losses cannot be.
    assert!(fault(|e| e.drop_probability = 0.9).contains("longer bursts"));
    assert!(StampError::default().check().is_ok());
}
