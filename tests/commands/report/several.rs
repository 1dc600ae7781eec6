//! Several logs on one page, side by side.

use super::{asks_nobody, data, figure};
use crate::made_logs::{motion, written};
use crate::program::strapd;

#[test]
fn several_logs_stand_side_by_side_in_one_page() {
    let dir = tempfile::tempdir().unwrap();
    let at_rest = motion(4000).split_off(3000);
    written(dir.path(), "a.mcap", &motion(3000));
    written(dir.path(), "<b>&'.mcap", &at_rest);
    std::fs::write(dir.path().join("c.mcap"), "no log").unwrap();
    let ran = strapd(
        dir.path(),
        "report a.mcap <b>&'.mcap c.mcap -o r.html --json",
    );
    assert_eq!(ran.code, Some(1), "one cannot be read: {ran:?}");
    let html = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    asks_nobody(&html);
    let row = |log: &str| {
        let (_, rest) = html
            .split_once(log)
            .unwrap_or_else(|| unreachable!("{log}"));
        rest.split_once("</tr>").unwrap().0
    };
    let of = |n: u8, name: &str| row(&format!("<td><a href=\"#log-{n}\">{name}</a></td>"));
    for (n, name, samples) in [(1, "a.mcap", 3000), (2, "&lt;b&gt;&amp;&#39;.mcap", 1000)] {
        let row = of(n, name);
        let cells: Vec<&str> = row.split("<td>").skip(1).collect();
        assert_eq!(cells[2], "0</td>", "lost: {row}");
        let whole = data(&html)[usize::from(n) - 1]["topics"][0]["replay"].clone();
        assert_eq!(whole["samples"]["total"], samples, "{whole}");
        let secs = whole["duration_s"].as_f64().unwrap();
        assert_eq!(cells[0], format!("{secs:.3}</td>"), "{row}");
        assert!(html.contains(&format!("<article id=\"log-{n}\">\n<h1>{name}</h1>")));
    }
    assert!(
        row("<td>c.mcap</td>").contains("no format that is read"),
        "{}",
        row("<td>c.mcap</td>")
    );
    // As many charts of each as of one alone, and a line of JSON for each that could be read.
    assert!(figure(&html, "rates").is_some() || html.matches("<svg").count() >= 6);
    assert_eq!(ran.out.lines().count(), 2, "{}", ran.out);
    assert!(ran.err.contains("3 logs: "), "{}", ran.err);
    // A reference of its own has one log.
    let refused = strapd(
        dir.path(),
        "report a.mcap c.mcap --reference a.mcap -o x.html",
    );
    assert_eq!(refused.code, Some(2));
    assert!(refused.err.contains("--ref-topic"), "{}", refused.err);
}

#[test]
fn a_page_about_a_hundred_logs_is_no_larger() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "a.mcap", &motion(300));
    let names: Vec<String> = (0..100).map(|n| format!("n{n:03}.mcap")).collect();
    for name in &names {
        std::fs::copy(dir.path().join("a.mcap"), dir.path().join(name)).unwrap();
    }
    let ran = strapd(
        dir.path(),
        &format!("report {} -o r.html --quiet", names.join(" ")),
    );
    assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
    let html = std::fs::read_to_string(dir.path().join("r.html")).unwrap();
    asks_nobody(&html);
    for name in &names {
        assert!(html.contains(name), "{name}");
    }
    assert_eq!(data(&html).as_array().unwrap().len(), 100);
}
