//! Promise: each setting of an estimation is one row, which says what the estimator takes and puts it where it belongs.

use std::collections::BTreeSet;
use strapd_attitude::condition::{Clock, GyroUnit, OnGap};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::settings::{
    Default, ROWS, Row, Takes, Value, defaults, named, row, with,
};
use strapd_attitude::estimate::{
    Aid, CLASS_BY_DATA, EstimationSettings, NOISE_PRESETS, SensorCalibration,
};
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::record::SampleKind;
use strapd_attitude::setting;
use strapd_attitude::worlds::World;

fn shown(plan: &EstimationSettings) -> String {
    format!("{plan:?}")
}

/// A plan with which every setting goes: a clock that has a rate, a method that has a window.
fn open() -> EstimationSettings {
    EstimationSettings {
        clock: Clock::Index { rate_hz: 100.0 },
        method: Method::MAGNUS,
        ..defaults()
    }
}

fn put(plan: &mut EstimationSettings, given: &[(&str, &str)]) -> Result<(), Diagnostic> {
    for row in &ROWS {
        for (_, text) in given.iter().filter(|(name, _)| *name == row.name()) {
            row.apply(plan, &Value::Text(text))?;
        }
    }
    plan.check()
}

/// Refusal of these settings.
fn refused(given: &[(&str, &str)]) -> String {
    put(&mut defaults(), given).unwrap_err().to_string()
}

#[test]
fn every_default_is_what_holds_where_nothing_is_given() {
    for row in &ROWS {
        if let Default::Value(text) = row.default {
            let mut plan = defaults();
            row.apply(&mut plan, &Value::Text(text)).unwrap();
            assert_eq!(shown(&plan), shown(&defaults()), "{}", row.name());
        }
    }
}

#[test]
fn every_row_says_what_it_is_and_sets_something_of_its_own() {
    let mut names = BTreeSet::new();
    for row in &ROWS {
        assert!(names.insert(row.name()), "{} twice", row.name());
        assert!(setting::ALL.contains(&row.setting), "{}", row.name());
        assert!(!row.meaning.is_empty() && !row.expected().is_empty());
        let is_switch = matches!(row.takes, Takes::Switch(_));
        assert_eq!(row.placeholder.is_empty(), is_switch, "{}", row.name());
        assert!(
            row.environment
                .is_none_or(|variable| variable == format!("STRAPD_{}", row.name().to_uppercase()))
        );
        let mut results = BTreeSet::new();
        for word in row.words {
            let mut plan = open();
            row.apply(&mut plan, &Value::Text(word.name)).unwrap();
            assert!(results.insert(shown(&plan)), "{} {}", row.name(), word.name);
        }
        let value = match row.takes {
            Takes::Words => continue,
            Takes::Switch(_) => Value::Switch(true),
            Takes::Number { .. } => Value::Number(0.03125),
            Takes::Count(_) => Value::Number(7.0),
            Takes::Rate(_) => Value::Numbers(&[0.1, -0.2, 0.3]),
            Takes::Mounting(_) | Takes::Attitude(_) => Value::Numbers(&[0.0, 0.6, 0.8, 0.0]),
            Takes::Factors(_) => Value::Number(0.5),
            Takes::Text { .. } => Value::Text("YxZ"),
            Takes::Figures(_) => Value::Text("arw=0.2"),
            Takes::Calibration(_) => Value::Calibration(SensorCalibration::default().into()),
        };
        results.insert(shown(&open()));
        let mut plan = open();
        row.apply(&mut plan, &value).unwrap();
        assert!(results.insert(shown(&plan)), "{}: {value}", row.name());
    }
}

#[test]
fn words_are_the_names_of_what_they_set_and_none_is_left_out() {
    let words = |name| row(name).unwrap().words.iter().map(|word| word.name);
    let plan = |name: &str, word: &str| {
        let mut plan = open();
        row(name)
            .unwrap()
            .apply(&mut plan, &Value::Text(word))
            .unwrap();
        plan
    };
    for kind in SampleKind::ALL {
        assert_eq!(plan("sample_kind", kind.name()).kind, Some(kind));
    }
    assert_eq!(words("sample_kind").count(), SampleKind::ALL.len());
    for unit in GyroUnit::ALL {
        assert_eq!(plan("gyro_unit", unit.name()).unit, Some(unit));
    }
    for policy in [OnGap::Hold, OnGap::Bridge, OnGap::Reset] {
        assert_eq!(plan("on_gap", policy.name()).on_gap, policy);
    }
    for clock in words("time") {
        assert_eq!(plan("time", clock).clock.name(), clock);
    }
    for world in words("world") {
        assert_eq!(plan("world", world).world, world.parse::<World>().unwrap());
        assert_eq!(plan("world", &world.to_uppercase()).world.name(), world);
    }
    for method in words("method").filter(|name| *name != "causal") {
        assert_eq!(plan("method", method).method.name(), method);
    }
    for class in &NOISE_PRESETS {
        assert_eq!(plan("noise", class.name).noise.name, class.name);
    }
    assert!(plan("noise", "none").noise.is_none());
    // One more is told by the data.
    assert_eq!(words("noise").count(), NOISE_PRESETS.len() + 2);
    assert_eq!(
        plan("noise", CLASS_BY_DATA).noise,
        EstimationSettings::default().noise
    );
    assert_eq!(plan("aid", "gravity+mag").aid, Aid::GravityAndField);
}

#[test]
fn units_are_taken_as_they_are_written_elsewhere_and_no_spelling_means_two_words() {
    for (spelling, unit) in [
        ("rad/s", GyroUnit::Rad),
        ("deg/s", GyroUnit::Deg),
        ("dps", GyroUnit::Deg),
        ("DPS", GyroUnit::Deg),
        ("mrad/s", GyroUnit::Mrad),
    ] {
        let mut plan = defaults();
        put(&mut plan, &[("gyro_unit", spelling)]).unwrap();
        assert_eq!(plan.unit, Some(unit), "{spelling}");
    }
    for row in &ROWS {
        let mut spellings = BTreeSet::new();
        for word in row.words {
            for spelling in std::iter::once(&word.name).chain(word.also) {
                let is_new = spellings.insert(spelling.to_lowercase());
                assert!(is_new, "{}: {spelling} twice", row.name());
            }
        }
    }
}

#[test]
fn a_range_is_that_of_the_check() {
    for row in &ROWS {
        let Takes::Number { range, .. } = row.takes else {
            continue;
        };
        let plan_with = |number: f64| {
            let mut plan = defaults();
            match row.name() {
                "rate_hz" => plan.clock = Clock::Index { rate_hz: f64::NAN },
                "declination" | "mag_hard_iron" => plan.aid = Aid::GravityAndField,
                "earth_rate" => plan.world = World::Enu,
                _ => {}
            }
            row.apply(&mut plan, &Value::Number(number)).unwrap();
            plan
        };
        let (least, most) = range;
        let step = if most.is_finite() {
            1e-6 * (most - least)
        } else {
            1e-6
        };
        let inside = [
            least + step,
            if most.is_finite() { most - step } else { 1e9 },
        ];
        for number in inside {
            let checked = plan_with(number).check();
            assert!(checked.is_ok(), "{} {number}: {checked:?}", row.name());
        }
        for number in [least - step, most + step, f64::NAN] {
            let why = plan_with(number).check().map_err(|why| why.to_string());
            let by_name = |why: &String| why.contains(row.name());
            assert!(
                why.as_ref().is_err_and(by_name),
                "{} {number}: {why:?}",
                row.name()
            );
        }
    }
}

#[test]
fn settings_that_belong_to_others_are_refused_without_them() {
    for (given, why) in [
        (&[("window", "4")][..], "belong to method magnus"),
        (&[("method", "rk4"), ("order", "6")], "not to rk4"),
        (&[("rate_hz", "100")], "rate_hz: only time index"),
        (
            &[("time", "index")],
            "the sample rate is needed too\n  help: rate_hz HZ",
        ),
        (&[("undo_truncation", "on=0")], "above 0 and below 1"),
        (&[("aid", "gravity"), ("noise", "none")], "noise none:"),
    ] {
        let said = refused(given);
        assert!(said.contains(why), "{given:?}: {said}");
    }
    let mut plan = defaults();
    let given = [
        ("order", "8"),
        ("window", "8"),
        ("method", "causal"),
        ("rate_hz", "50"),
        ("time", "index"),
    ];
    put(&mut plan, &given).unwrap();
    let method = Method::Magnus {
        window: 8,
        order: Order::M8,
        placement: Placement::Causal,
    };
    assert_eq!(
        (plan.method, plan.clock),
        (method, Clock::Index { rate_hz: 50.0 })
    );
    put(
        &mut plan,
        &[("method", "commit"), ("window", "4"), ("order", "2")],
    )
    .unwrap();
    assert_eq!(plan.method.to_string(), "commit (window 4, order 2)");
}

#[test]
fn a_value_that_is_none_is_refused_with_what_is_expected() {
    let wrong =
        |row: &Row, value: &Value<'_>| row.apply(&mut open(), value).unwrap_err().to_string();
    for (name, text, why) in [
        (
            "aid",
            "magic",
            "aid: there is no \"magic\"\n  help: auto, none, gravity, or gravity+mag",
        ),
        (
            "bias",
            "1,2",
            "bias 1,2: expected none, auto, or 3 numbers x,y,z in rad/s",
        ),
        ("bias", "nan,0,0", "bias nan,0,0: expected none"),
        (
            "init",
            "rpy=1,2",
            "expected identity, gravity, first-orientation, or 4 numbers q=w,x,y,z, or 3",
        ),
        (
            "init",
            "q=1,1,1,1",
            "init q=1,1,1,1: a unit quaternion w,x,y,z is needed, this one has norm 2",
        ),
        ("mount", "1,0,0", "mount 1,0,0: expected 4 numbers"),
        (
            "max_gap",
            "long",
            "max_gap long: expected a number from 0 to 86400 in s",
        ),
        ("window", "-1", "expected a number of samples"),
        ("noise", "loud", "noise loud: `loud` is no class"),
        ("noise", "rrw=1", "arw is missing"),
        (
            "undo_truncation",
            "maybe",
            "expected auto, on, off, or on=STEP from 0 to 1 in rad/s",
        ),
        ("body", "XXY", "body: "),
        ("gyro_axes", "XXY", "gyro_axes: "),
        (
            "gyro_scale",
            "-1",
            "gyro_scale -1: expected a factor above 0, or 3 of them",
        ),
        (
            "accel_scale",
            "1,2",
            "accel_scale 1,2: expected a factor above 0",
        ),
        ("smooth", "yes", "smooth yes: expected true or false"),
        ("calibration", "imu.toml", "expected a calibration"),
    ] {
        let said = wrong(row(name).unwrap(), &Value::Text(text));
        assert!(said.contains(why), "{name} {text}: {said}");
        assert!(said.starts_with(name), "{said}");
    }
    let said = wrong(row("init").unwrap(), &Value::Numbers(&[1.0, 2.0, 3.0]));
    assert!(said.contains("init 1,2,3: expected"), "{said}");
    let hostile = "\u{7}".repeat(1000);
    assert!(wrong(row("time").unwrap(), &Value::Text(&hostile)).len() < 400);
    assert_eq!(
        with(setting::BIAS, "0.1,0,0").unwrap().noise,
        defaults().noise
    );
}

#[test]
fn texts_name_settings_that_there_are() {
    for text in ROWS.iter().flat_map(|row| {
        let words = row.words.iter().map(|word| word.meaning);
        words.chain([row.meaning, row.effect])
    }) {
        for name in text.split('{').skip(1) {
            let name = name.split('}').next().unwrap();
            assert!(setting::ALL.iter().any(|s| s.name() == name), "{text}");
        }
    }
    assert_eq!(
        named("by {time} index, or {aid}."),
        "by time index, or aid."
    );
}
