//! Quotations of pages that are no command: the library's first example, and the summary of a replay.

use super::fences::blocks;
use super::root;
use crate::program::strapd;
use strapd_attitude::record::Nanos;

/// The README's example, letter by letter.
mod example {
    #![allow(unreachable_pub)]
    // The README's.
    use strapd_attitude::diagnostic::Diagnostic;
    use strapd_attitude::estimate::{
        EstimationSettings, Estimator, Meaning, Patience, Preparation,
    };
    use strapd_attitude::propagate::Sequential;
    use strapd_attitude::record::{AttitudeSample, Declared, RawSample};

    pub fn attitudes(samples: &[RawSample]) -> Result<Vec<AttitudeSample>, Diagnostic> {
        let plan = EstimationSettings::default(); // the flags of `replay`, as fields
        let meaning = Meaning::new(&plan, &Declared::default()); // rad/s, x forward, y left, z up; means or rates by their step
        let mut preparation = Preparation::new(&plan, &meaning, Patience::WholeLog);
        for sample in samples {
            preparation.take(sample)?;
        }
        let mut estimator = Estimator::new(&plan, &meaning, &preparation.decide()?)?;
        for sample in samples {
            estimator.take(sample);
        }
        Ok(estimator.finish(&Sequential).to_vec())
    }
    // The end of it.
}

fn block(page: &str, language: &str) -> String {
    let page = std::fs::read_to_string(root().join(page)).unwrap();
    let mut found = blocks(&page).into_iter().filter(|b| b.language == language);
    let block = found.next().unwrap();
    assert!(found.next().is_none(), "two blocks of {language}");
    block.text
}

#[test]
fn the_readme_s_example_of_the_library_is_code_that_runs() {
    let (_, from) = include_str!("quoted.rs")
        .split_once("    // The README's.\n")
        .unwrap();
    let (code, _) = from.split_once("    // The end of it.\n").unwrap();
    let plain: Vec<String> = code
        .lines()
        .map(|line| {
            line.strip_prefix("    ")
                .unwrap_or(line)
                .replacen("pub fn", "fn", 1)
        })
        .collect();
    assert_eq!(
        block("README.md", "rust").trim_end(),
        plain.join("\n").trim_end()
    );

    // A quarter turn about z in a second, level.
    let samples: Vec<_> = (0..=100)
        .map(|k| strapd_attitude::record::RawSample {
            header: Some(Nanos(k * 10_000_000)),
            gyro: Some([0.0, 0.0, std::f64::consts::FRAC_PI_2]),
            accel: Some([0.0, 0.0, 9.80665]),
            ..Default::default()
        })
        .collect();
    let attitudes = example::attitudes(&samples).unwrap();
    assert_eq!(attitudes.len(), 101);
    let yaw = attitudes[100].q_nb.yaw_pitch_roll().yaw.to_degrees();
    assert!(
        (yaw - 90.0).abs() < 0.1,
        "{yaw}: what the filter may learn of scale in a second"
    );
}

/// Numbers move with the numerics; what is said, and in which order, must not without its page.
#[test]
fn the_summary_in_the_usage_page_is_what_a_replay_prints() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("fixtures")).unwrap();
    std::fs::copy(
        root().join("fixtures/xsens_mti.mcap"),
        dir.path().join("fixtures/xsens_mti.mcap"),
    )
    .unwrap();
    let ran = strapd(
        dir.path(),
        "replay fixtures/xsens_mti.mcap -o attitude.mcap --aid auto",
    );
    let without_numbers = |text: &str| {
        // How long it took is nobody's promise.
        let text = text.split("\n  took ").next().unwrap_or_default();
        let is_part = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
        let mut words = Vec::new();
        for word in text.split_whitespace() {
            let is_number = word.contains(|c: char| c.is_ascii_digit());
            words.push(if is_number {
                word.replace(is_part, "")
            } else {
                word.to_owned()
            });
        }
        words.join(" ")
    };
    let quoted = block("docs/usage.md", "text");
    assert_eq!(without_numbers(&quoted), without_numbers(&ran.done().out));
}
