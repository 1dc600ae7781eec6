//! Every recording: a page that is sound, or a clear error.

use super::{figure, is_sound};
use crate::program::strapd;
use crate::shared_data::shared;
use std::path::{Path, PathBuf};

fn logs(folder: &str) -> Vec<PathBuf> {
    let Some(folder) = shared(&format!("logs/{folder}")) else {
        return Vec::new();
    };
    let mut logs: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    logs.sort();
    assert!(logs.len() > 4);
    logs
}

/// The page and the exit code; `None` = a clear error, and no file.
fn reported(dir: &Path, log: &Path) -> Option<(String, i32)> {
    let page = dir.join("r.html");
    // Bounded in processor time, as every run of it.
    let ran = strapd(
        dir,
        &format!("report {} -o r.html --json --force", log.display()),
    );
    assert!(!ran.err.contains("panicked"), "{ran:?}");
    match ran.code {
        Some(code @ (0 | 3)) => {
            let html = std::fs::read_to_string(&page).unwrap();
            let data = is_sound(&html);
            let printed: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
            assert_eq!(data, printed, "the page and --json say the same");
            assert_eq!(data["lossy"], code == 3, "{}", log.display());
            std::fs::remove_file(&page).unwrap();
            Some((html, code))
        }
        Some(1) => {
            ran.refused(1, &[]);
            assert!(!page.exists());
            None
        }
        _ => panic!("{ran:?}"),
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn real_recordings_are_drawn_whole() {
    let dir = tempfile::tempdir().unwrap();
    for log in logs("real") {
        let (html, _) = reported(dir.path(), &log).expect("a page");
        for id in ["rate", "attitude", "sigma"] {
            let figure = figure(&html, id).unwrap_or_else(|| panic!("{id} of {}", log.display()));
            assert!(figure.contains("<polyline"), "{id} of {}", log.display());
        }
        let jitter = figure(&html, "jitter").is_some_and(|f| f.contains("<polyline"));
        let even = html.contains("there is no jitter to draw");
        assert!(jitter != even, "jitter of {}", log.display());
        assert!(
            html.contains("so 5") || html.contains("there is none in this log"),
            "rest missing"
        );
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn native_and_hostile_files_end_in_a_page_or_a_clear_error() {
    let dir = tempfile::tempdir().unwrap();
    for log in logs("native").into_iter().chain(logs("hostile")) {
        let name = log.file_name().unwrap().to_string_lossy().into_owned();
        let Some((html, code)) = reported(dir.path(), &log) else {
            continue;
        };
        let data = super::data(&html);
        let says = |code: &str| {
            data["findings"]
                .as_array()
                .unwrap()
                .iter()
                .any(|f| f["code"] == code)
        };
        match name.split('_').next().unwrap() {
            "02" => assert!(code == 3 && says("file-damaged"), "{name}"),
            "08" => assert!(says("shared-stamps") || says("repeats"), "{name}"),
            "09" => {
                assert!(code == 3 && says("gap-held"), "{name}");
                assert!(figure(&html, "timeline").unwrap().contains("gap held"));
            }
            "10" => {
                assert!(code == 3 && says("not-finite"), "{name}");
                let marks = &data["topics"][0]["marks"];
                assert_eq!(marks["not_finite"], 5, "{marks}");
                assert!(figure(&html, "timeline").unwrap().contains("NaN"));
            }
            "13" => assert_eq!(data["topics"].as_array().unwrap().len(), 2, "{name}"),
            "16" => assert!(code == 3 && says("undecodable"), "{name}"),
            "25" => {
                assert!(code == 3 && says("no-imu-topic"), "{name}");
                assert!(html.contains("No attitude could be had"));
            }
            _ => {}
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_page_says_what_check_and_compare_say() {
    let Some(log) = shared("logs/real/broad07_60s_ros2_zstd.mcap") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let (html, _) = reported(dir.path(), &log).unwrap();
    let data = super::data(&html);
    let checked = strapd(dir.path(), &format!("check {} --json", log.display()));
    let checked: serde_json::Value = serde_json::from_str(&checked.out).unwrap();
    let codes = |v: &serde_json::Value| -> Vec<String> {
        let all = v["findings"].as_array().unwrap();
        all.iter()
            .map(|f| f["code"].to_string() + &f["what"].to_string())
            .collect()
    };
    assert_eq!(codes(&data), codes(&checked));
    // README's numbers, and those of compare on a replay's output.
    let kinds = data["topics"][0]["reference_error"]["kinds"]
        .as_array()
        .unwrap();
    let of = |kind: &str| kinds.iter().find(|k| k["kind"] == kind).unwrap();
    assert_eq!(kinds.len(), 4);
    let median = of("average")["relative_1s"]["median_deg"].as_f64().unwrap();
    assert!((median - 0.920).abs() < 0.002, "{median}");
    strapd(
        dir.path(),
        &format!(
            "replay {} -q -o est.mcap --sample-kind average",
            log.display()
        ),
    );
    let compared = strapd(
        dir.path(),
        &format!(
            "compare est.mcap {} --ref-topic /reference/orientation --json",
            log.display()
        ),
    );
    let compared = compared.json();
    let rms = |v: &serde_json::Value| v["total"]["rms_deg"].as_f64().unwrap();
    assert!(
        (rms(&compared) - rms(of("average"))).abs() < 1e-9,
        "{compared} {}",
        of("average")
    );
    assert!(figure(&html, "error").is_some() && figure(&html, "error-parts").is_some());
}
