//! Promise: `strapd report` says on one self-contained page what is good and what is wrong about any log,
//! and what it can not say it says so.

mod browser;
mod pages;
mod recordings;

use serde_json::Value;

/// The JSON block of a page.
fn data(html: &str) -> Value {
    let begin = "<script type=\"application/json\" id=\"report\">";
    let (_, rest) = html.split_once(begin).expect("a JSON block");
    let (text, _) = rest.split_once("</script>").expect("its end");
    serde_json::from_str(text).unwrap()
}

/// One figure of a page.
fn figure<'h>(html: &'h str, id: &str) -> Option<&'h str> {
    let (_, rest) = html.split_once(&format!("<figure id=\"{id}\">"))?;
    Some(rest.split_once("</figure>").expect("its end").0)
}

/// What every page must be, whatever the log.
#[track_caller]
fn is_sound(html: &str) -> Value {
    assert!(html.len() <= 2_000_000, "{} bytes", html.len());
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"));
    for part in ["id=\"verdict\"", "id=\"findings\"", "SHA-256", "<code>"] {
        assert!(html.contains(part), "{part}");
    }
    // Nothing is fetched: nothing that could, no script that runs, no import.
    let fetching = [
        "<img",
        "<link rel=\"stylesheet",
        "<iframe",
        "<object",
        "<embed",
        "@import",
        "url(",
    ];
    for word in fetching {
        assert!(!html.contains(word), "{word}");
    }
    assert_eq!(html.matches("<script").count(), 1);
    for drawing in html.split("points=\"").skip(1) {
        let points = drawing.split('"').next().unwrap();
        assert!(!points.contains(char::is_alphabetic), "{points:.100}");
    }
    let data = data(html);
    let text = data["verdict"]["text"].as_str().unwrap();
    assert!(text.len() > 20 && text.ends_with('.'), "{text}");
    data
}
