//! Made logs: spikes, silence, hostile names, outputs.

use super::{data, figure, is_sound};
use crate::made_logs::{ImuSample, PACKINGS, START, TOPIC, bytes, logged, motion, written};
use crate::program::strapd;
use serde_json::Value;
use std::path::Path;

/// The page about these samples.
fn page(dir: &Path, samples: &[ImuSample], flags: &str) -> (String, Option<i32>) {
    written(dir, "log.mcap", samples);
    let ran = strapd(dir, &format!("report log.mcap -o r.html --force {flags}"));
    assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
    let html = std::fs::read_to_string(dir.join("r.html")).unwrap();
    is_sound(&html);
    (html, ran.code)
}

/// Pixels `[x, y]` of every line of a chart.
fn drawn(figure: &str) -> Vec<[f64; 2]> {
    let lines = figure.split("points=\"").skip(1);
    lines
        .flat_map(|rest| rest.split('"').next().unwrap().split_whitespace())
        .map(|pair| {
            let (x, y) = pair.split_once(',').unwrap();
            [x.parse().unwrap(), y.parse().unwrap()]
        })
        // To the left of the axes lie their ticks, to the right the legend.
        .filter(|p: &[f64; 2]| (72.0..=808.0).contains(&p[0]))
        .collect()
}

#[test]
fn a_spike_of_one_sample_is_seen() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(30_000);
    samples[12_345].gyro[1] = 30.0;
    let (html, _) = page(dir.path(), &samples, "--spikes keep");
    let rate = figure(&html, "rate").unwrap();
    // Three lines of at most four points in each of 1400 stretches.
    assert!(drawn(rate).len() < 17_000);
    // The spike is of 1719 deg/s, all else below 100.
    let labels = rate
        .lines()
        .filter_map(|line| line.trim().parse::<f64>().ok());
    let largest = labels.fold(0.0, f64::max);
    assert!(
        (1000.0..1800.0).contains(&largest),
        "the axis has {largest}"
    );
    let highest = drawn(rate)
        .into_iter()
        .min_by(|a, b| a[1].total_cmp(&b[1]))
        .unwrap();
    let above: Vec<_> = drawn(rate)
        .into_iter()
        .filter(|p| p[1] < highest[1] + 100.0)
        .collect();
    assert!(
        above.len() <= 2,
        "one spike alone reaches up there: {above:?}"
    );
    let places = drawn(rate).into_iter().map(|p| p[0]);
    let (left, right) = (
        places.clone().fold(f64::MAX, f64::min),
        places.fold(0.0, f64::max),
    );
    let place = (highest[0] - left) / (right - left);
    assert!((place - 12_345.0 / 30_000.0).abs() < 0.01, "{place}");
}

#[test]
fn what_can_not_be_said_is_said_to_be_so() {
    let dir = tempfile::tempdir().unwrap();
    let (html, code) = page(dir.path(), &motion(1), "");
    assert_eq!(code, Some(0));
    assert!(html.contains("One sample is an instant") && html.contains("Fewer than two stamps"));
    assert!(html.contains("the messages carry no orientation") && html.contains("never at rest"));
    let mut samples = motion(300);
    samples.iter_mut().for_each(|s| s.gyro[0] = f64::NAN);
    let (html, code) = page(dir.path(), &samples, "");
    assert_eq!(code, Some(3));
    assert!(html.contains("No sample was used") && html.contains("No attitude could be had"));
    assert_eq!(super::data(&html)["verdict"]["level"], "bad");
    let mut samples = motion(300);
    samples.iter_mut().for_each(|s| s.gyro_covariance_0 = -1.0);
    let (html, _) = page(dir.path(), &samples, "");
    assert!(html.contains("--ignore-covariance-flag"));
    let (html, _) = page(dir.path(), &samples, "--ignore-covariance-flag");
    assert!(figure(&html, "rate").is_some());
}

#[test]
fn a_flag_answers_its_finding() {
    let dir = tempfile::tempdir().unwrap();
    let still: Vec<ImuSample> = motion(1500)
        .into_iter()
        .enumerate()
        .map(|(i, s)| ImuSample {
            gyro: [0.01, 1e-5 * (i % 7) as f64, -1e-5 * (i % 5) as f64],
            accel: [0.0, 0.0, 9.80665],
            ..s
        })
        .collect();
    let level = |flags: &str| {
        let (html, _) = page(dir.path(), &still, flags);
        (super::data(&html), html)
    };
    let (with, html) = level("");
    assert_eq!(with["verdict"]["level"], "warning", "{}", with["verdict"]);
    assert!(
        html.contains("so 585 s are missing"),
        "15 s of rest are not 600"
    );
    let (without, html) = level("--bias auto");
    assert_eq!(
        without["verdict"]["level"], "good",
        "{}",
        without["verdict"]
    );
    assert!(html.contains("dealt with by <code>--bias</code>"));
}

#[test]
fn ten_minutes_of_rest_give_an_allan_deviation() {
    let dir = tempfile::tempdir().unwrap();
    strapd(
        dir.path(),
        "simulate coning --half-angle-deg 0 --frequency-hz 0.001 --duration 640 --rate-hz 20 --noise arw=0.3 --seed 3 -q -o rest.mcap",
    )
    .done();
    strapd(dir.path(), "report rest.mcap -o r.html").done();
    let html = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    let data = is_sound(&html);
    assert!(figure(&html, "allan").is_some() && html.contains("arw, deg/sqrt(h)"));
    let arw = |v: &Value| v["axes"][0]["terms_si"]["arw"]["value"].as_f64().unwrap();
    let allan = strapd(dir.path(), "allan rest.mcap --json").json();
    let (here, there) = (arw(&data["topics"][0]["allan"]), arw(&allan));
    // Of nearly the same samples: the rest may be a window shorter than the record.
    assert!((here / there - 1.0).abs() < 0.02, "{here} {there}");
}

#[test]
fn a_reference_from_another_file_is_held_against() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    strapd(dir, "simulate top --duration 5 -q -o top.mcap").done();
    strapd(dir, "replay top.mcap -q -o est.csv").done();
    strapd(dir, "report top.mcap -o r.html --reference est.csv").done();
    let html = std::fs::read_to_string(dir.join("r.html")).unwrap();
    let data = is_sound(&html);
    let error = &data["topics"][0]["reference_error"];
    let used = error["kinds"]
        .as_array()
        .unwrap()
        .iter()
        .find(|k| k["used"] == true)
        .unwrap();
    assert!(
        used["total"]["max_deg"].as_f64().unwrap() < 1e-5,
        "the same run: {used}"
    );
    assert!(html.contains("est.csv"));
    strapd(dir, "report top.mcap -o n.html --ref-topic /nowhere")
        .refused(1, &["/nowhere", "/truth"]);
    strapd(dir, "report top.mcap -o n.html --reference none.csv").refused(1, &["none.csv"]);
    assert!(!dir.join("n.html").exists());
}

#[test]
fn names_in_a_log_can_not_become_markup() {
    let dir = tempfile::tempdir().unwrap();
    const EVIL: &str = "</script><img src=x onerror=alert(1)>'\"&";
    let mut messages = logged(EVIL, &motion(300));
    messages.extend(logged(TOPIC, &motion(300)));
    let path = dir.path().join("evil.mcap");
    std::fs::write(path, bytes(PACKINGS[0].1, 4096, &messages)).unwrap();
    let ran = strapd(dir.path(), "report evil.mcap -o -");
    assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
    let data = is_sound(&ran.out);
    assert!(!ran.out.contains("<img"));
    assert!(
        data["topics"]
            .as_array()
            .unwrap()
            .iter()
            .any(|t| t["topic"] == EVIL)
    );
}

#[test]
fn a_clock_that_jumps_cuts_the_axis_and_hides_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(900);
    for (i, s) in samples.iter_mut().enumerate() {
        s.stamp += match i {
            0..300 => -START,
            300..600 => 0,
            _ => -3_000_000_000,
        };
    }
    let (html, code) = page(dir.path(), &samples, "");
    assert_eq!(code, Some(3));
    assert!(html.contains("the axis of time is cut there"));
    let rate = drawn(figure(&html, "rate").unwrap());
    let (left, right) = (rate[0][0], rate.iter().map(|p| p[0]).fold(0.0, f64::max));
    let middle = |p: &&[f64; 2]| (0.3..0.7).contains(&((p[0] - left) / (right - left)));
    assert!(
        rate.iter().filter(middle).count() > 200,
        "the samples fill the chart"
    );
}

#[test]
fn outputs_are_whole_or_absent() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    written(dir, "log.mcap", &motion(300));
    strapd(dir, "report log.mcap").refused(2, &["-o report.html", "--json"]);
    strapd(dir, "report log.mcap -o - --json").refused(2, &["stdout"]);
    strapd(dir, "report log.mcap -o log.mcap --force").refused(1, &["is the input"]);
    strapd(dir, "report none.mcap -o r.html").refused(1, &["none.mcap"]);
    strapd(dir, "report log.mcap -o r.html");
    strapd(dir, "report log.mcap -o r.html").refused(1, &["already exists", "--force"]);
    strapd(dir, "report log.mcap -o r.html --init gravity").refused(1, &["already exists"]);
    let mut names: Vec<_> = std::fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["log.mcap", "r.html"]);
}

#[test]
fn compare_draws_its_errors() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    strapd(dir, "simulate top --duration 5 -q -o top.mcap").done();
    strapd(dir, "replay top.mcap -q -o est.csv --method dcm-right").done();
    let ran = strapd(dir, "compare est.csv top.mcap --plot error.svg");
    ran.done();
    let svg = std::fs::read_to_string(dir.join("error.svg")).unwrap();
    for word in ["total, rms", "heading, rms", "tilt, rms", "95 %", "max"] {
        assert!(svg.contains(word), "{word}");
    }
    // The numbers of the text stand in the title.
    let total = ran
        .out
        .lines()
        .find(|l| l.trim_start().starts_with("total"))
        .unwrap();
    for number in total.split_whitespace().skip(1) {
        assert!(svg.contains(number), "{number}: {total}");
    }
    strapd(dir, "compare est.csv top.mcap --plot error.svg")
        .refused(1, &["already exists", "--force"]);
    strapd(dir, "compare est.csv top.mcap --plot error.png").refused(2, &["SVG", "error.svg"]);
    strapd(dir, "compare est.csv top.mcap --plot error.svg --force").done();
}

#[test]
fn errors_lie_between_their_three_sigma_and_what_was_learned_is_in_a_table() {
    let dir = tempfile::tempdir().unwrap();
    let samples: Vec<ImuSample> = motion(3000)
        .into_iter()
        .map(|sample| ImuSample {
            orientation: None,
            accel: [0.0, 0.0, 9.80665],
            ..sample
        })
        .collect();
    let (html, _) = page(dir.path(), &samples, "");
    // Without a reference: sigma of tilt and of heading.
    let sigma = figure(&html, "sigma").unwrap();
    assert!(
        sigma.contains("tilt") && sigma.contains("heading"),
        "{sigma}"
    );
    assert!(figure(&html, "tilt-bounds").is_none() && !html.contains("within-sigma"));
    assert!(!html.contains("Calibration learned"));
    assert!(html.contains("class consumer, --noise"));
    assert!(figure(&html, "innovations").is_none());
    // Held against an attitude of its own: no error, which lies within.
    strapd(dir.path(), "replay log.mcap -o truth.csv -q").done();
    let (html, _) = page(dir.path(), &samples, "--reference truth.csv");
    for id in ["tilt-bounds", "heading-bounds"] {
        let figure = figure(&html, id).unwrap_or_else(|| panic!("{id}"));
        assert!(
            figure.contains("3 sigma") && figure.contains("error"),
            "{figure}"
        );
    }
    assert!(
        html.contains("Sigma holds. Within 3 sigma: tilt 100 %"),
        "no verdict"
    );
    // And against one that turns otherwise.
    let (html, _) = page(dir.path(), &samples, "--reference truth.csv --bias 0,0,0.1");
    assert!(html.contains("The error is beyond 3 sigma"), "no verdict");
    assert!(html.contains("bias-by-orientation") && html.contains("beyond-sigma"));
    let (html, _) = page(dir.path(), &samples, "--aid gravity");
    assert!(html.contains("Calibration learned") && html.contains("accelerometer time offset, ms"));
    // Gravity alone was measured.
    let innovations = figure(&html, "innovations").unwrap();
    assert!(innovations.contains("<polyline") && innovations.contains("3 sigma"));
    assert!(figure(&html, "innovations-heading").is_none());
}

#[test]
fn the_verdict_and_what_was_written_are_said() {
    let dir = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let log = fixtures.join("xsens_mti.mcap");
    let ran = strapd(dir.path(), &format!("report {} -o r.html", log.display()));
    assert_eq!(ran.out, "");
    let size = std::fs::metadata(dir.path().join("r.html")).unwrap().len();
    let kilobytes = format!("wrote r.html  {:.1} kB", size as f64 * 1e-3);
    assert!(ran.err.contains(&kilobytes), "{kilobytes}: {}", ran.err);
    let html = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    let verdict = data(&html)["verdict"]["text"].as_str().unwrap().to_owned();
    assert!(ran.err.contains(&verdict), "{}", ran.err);
    // All of the error of this attitude, as it is held against its sigma, and not that of the gyro over 1 s alone.
    let (_, judged) = html.split_once("<p id=\"within-sigma\">").unwrap();
    let rms = |part: &str| {
        let (_, rest) = judged.split_once(part).unwrap();
        let (_, rest) = rest.split_once("(rms ").unwrap();
        rest.split_once(" deg").unwrap().0.to_owned()
    };
    let said = format!(
        ", {} deg of tilt and {} deg of heading from the reference (rms; the gyro alone ",
        rms("3 sigma: tilt"),
        rms(", heading")
    );
    assert!(verdict.contains(&said), "{said}: {verdict}");
    // Several beside each other have the same.
    let two = format!("report {0} {0} -o two.html", log.display());
    assert_eq!(strapd(dir.path(), &two).code, Some(0));
    let two = std::fs::read_to_string(dir.path().join("two.html")).unwrap();
    let cell = format!("<td>{} / {}</td>", rms("3 sigma: tilt"), rms(", heading"));
    assert_eq!(two.matches(&cell).count(), 2, "{cell}");
    // Of a log nothing can be had of, too.
    let empty = strapd(
        dir.path(),
        &format!("report {} -o e.html --topic /nothing", log.display()),
    );
    assert!(!empty.err.is_empty() && empty.code != Some(0), "{empty:?}");
}
