//! Tests in headless Chromium: the page opens from a file, without a complaint and without a request.

use crate::made_logs::{Logged, bytes, imu_message, motion, written};
use crate::program::strapd;
use std::process::Command;
use std::time::{Duration, Instant};

/// The browser's name.
fn chromium() -> &'static str {
    let found = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| {
            let version = Command::new(name).arg("--version").output();
            version.is_ok_and(|ran| ran.status.success())
        });
    found.expect("there is no Chromium")
}

/// The page after it was loaded, and what the browser said meanwhile.
fn opened(browser: &str, page: &std::path::Path) -> (String, String) {
    let profile = tempfile::tempdir().unwrap();
    let (out, err) = (profile.path().join("out"), profile.path().join("err"));
    let mut running = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"])
        .args(["--enable-logging=stderr", "--v=0", "--no-first-run"])
        // Whatever it might ask for, there is nobody: a request would fail and be complained about.
        .args([
            "--disable-background-networking",
            "--proxy-server=127.0.0.1:9",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", page.display()))
        .stdout(std::fs::File::create(&out).unwrap())
        .stderr(std::fs::File::create(&err).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while running.try_wait().unwrap().is_none() {
        // By the clock, as a last resort.
        if begun.elapsed() > Duration::from_secs(600) {
            running.kill().unwrap();
            let _ = running.wait();
            panic!(
                "timed out: Chromium did not end within 600 s: {:?}",
                std::fs::read_to_string(&err)
            );
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let read = |path| String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
    (read(&out), read(&err))
}

fn complaints(said: &str) -> Vec<&str> {
    said.lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect()
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_page_opens_from_a_file_without_a_complaint() {
    let browser = chromium();
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "log.mcap", &motion(3000));
    strapd(dir.path(), "report log.mcap -o r.html");
    let page = dir.path().join("r.html");
    let (dom, said) = opened(browser, &page);
    assert!(dom.contains("id=\"verdict\""), "{dom:.300} {said}");
    assert!(dom.contains("</html>"));
    assert_eq!(complaints(&said), Vec::<&str>::new());
    // Its script has drawn: charts can be looked into, and are told.
    let told = dom.matches("aria-valuetext=\"0:").count();
    assert!(
        told >= 3 && dom.matches("<canvas").count() == told,
        "{told} charts: {said}"
    );
    // Another script does not run.
    let html = std::fs::read_to_string(&page).unwrap();
    let strange = dir.path().join("strange.html");
    let added = "<main><script>document.title = 'owned';</script>";
    std::fs::write(&strange, html.replace("<main>", added)).unwrap();
    let (dom, said) = opened(browser, &strange);
    assert!(!dom.contains("<title>owned"), "{dom:.300}");
    assert!(!complaints(&said).is_empty(), "and that is said");
    // Would it be seen? The same page with a request and an error is complained about.
    let html = std::fs::read_to_string(&page).unwrap();
    let spoilt = dir.path().join("spoilt.html");
    std::fs::write(
        &spoilt,
        html.replace("<main>", "<main><img src=\"http://127.0.0.1:9/x.png\">"),
    )
    .unwrap();
    let (_, said) = opened(browser, &spoilt);
    assert!(!complaints(&said).is_empty(), "{said}");
}

/// A topic, a frame and a file whose names are made to break out of the page.
#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn names_made_to_run_do_not() {
    let browser = chromium();
    let dir = tempfile::tempdir().unwrap();
    const EVIL: &str = "</script><script>document.title='owned'</script><!--<img src=x onerror=\"document.title='owned'\">\u{2028}'\"`${document.title='owned'}";
    let messages: Vec<Logged> = motion(2000)
        .iter()
        .map(|sample| Logged {
            topic: EVIL,
            log_time: sample.stamp as u64,
            payload: imu_message(EVIL, sample),
        })
        .collect();
    let name = "<!--<script>'\"\u{2028}.mcap";
    std::fs::write(dir.path().join(name), bytes(Some(None), 4096, &messages)).unwrap();
    let ran = Command::new(env!("CARGO_BIN_EXE_strapd"))
        .current_dir(dir.path())
        .args(["report", name, "-o", "r.html"])
        .output()
        .unwrap();
    assert!(matches!(ran.status.code(), Some(0 | 3)), "{ran:?}");
    let html = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    super::is_sound(&html);
    let (dom, said) = opened(browser, &dir.path().join("r.html"));
    assert_eq!(complaints(&said), Vec::<&str>::new());
    assert!(
        !dom.contains("<title>owned") && !dom.contains("<img"),
        "{dom:.500}"
    );
    assert!(
        dom.matches("aria-valuetext=\"0:").count() >= 3,
        "its own script has run: {said}"
    );
    // Beside another log, too.
    written(dir.path(), "log.mcap", &motion(1000));
    let ran = Command::new(env!("CARGO_BIN_EXE_strapd"))
        .current_dir(dir.path())
        .args(["report", name, "log.mcap", "-o", "both.html"])
        .output()
        .unwrap();
    assert!(matches!(ran.status.code(), Some(0 | 3)), "{ran:?}");
    let (dom, said) = opened(browser, &dir.path().join("both.html"));
    assert_eq!(complaints(&said), Vec::<&str>::new());
    assert!(
        !dom.contains("<title>owned") && !dom.contains("<img"),
        "{dom:.500}"
    );
    assert!(
        dom.matches("aria-valuetext=\"0:").count() >= 6,
        "charts of both: {said}"
    );
}
