//! Promise: `strapd report` says on one self-contained page what is good and what is wrong about any log,
//! and what it cannot say it says so.

mod browser;
mod pages;
mod recordings;
mod several;

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
    let (_, rest) = html.split_once(&format!("<figure id=\"{id}\" tabindex=\"0\">"))?;
    Some(rest.split_once("</figure>").expect("its end").0)
}

/// Hash by which a policy names a script: 256 bits are 43 letters and a `=`.
fn hash(script: &str) -> String {
    use sha2::{Digest as _, Sha256};
    let digest = Sha256::digest(script.as_bytes());
    let letters: Vec<u8> = (b'A'..=b'Z')
        .chain(b'a'..=b'z')
        .chain(b'0'..=b'9')
        .chain([b'+', b'/'])
        .collect();
    let bits: String = digest
        .iter()
        .map(|byte| format!("{byte:08b}"))
        .collect::<String>()
        + "00";
    let of = |bits: &str| char::from(letters[usize::from_str_radix(bits, 2).unwrap()]);
    let text: String = (0..bits.len())
        .step_by(6)
        .map(|at| of(&bits[at..at + 6]))
        .collect();
    format!("'sha256-{text}='")
}

/// Asserts what holds of every page about one log, whatever the log.
#[track_caller]
fn is_sound(html: &str) -> Value {
    asks_nobody(html);
    let data = data(html);
    let text = data["verdict"]["text"].as_str().unwrap();
    assert!(text.len() > 20 && text.ends_with('.'), "{text}");
    data
}

/// Asserts what holds of every page.
#[track_caller]
fn asks_nobody(html: &str) {
    assert!(html.len() <= 2_000_000, "{} bytes", html.len());
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"));
    for part in ["id=\"verdict\"", "id=\"findings\"", "SHA-256", "<code>"] {
        assert!(html.contains(part), "{part}");
    }
    // What scrolls where the screen is narrow takes the keyboard.
    for scrolls in ["<div class=\"wide\"", "<figure "] {
        for part in html.split(scrolls).skip(1) {
            let (head, _) = part.split_once('>').unwrap();
            assert!(head.contains("tabindex=\"0\""), "{scrolls}{head}");
        }
    }
    // Nothing is fetched: nothing that could, and no script but the page's own, named by its hash.
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
    let scripts: Vec<&str> = html.split("<script").skip(1).collect();
    let own: Vec<_> = scripts
        .iter()
        .filter_map(|rest| rest.strip_prefix(" type=\"module\">"))
        .collect();
    let blocks = scripts
        .iter()
        .filter(|rest| rest.starts_with(" type=\"application/json\" "));
    assert_eq!(own.len(), 1);
    assert_eq!(
        blocks.count(),
        scripts.len() - 1,
        "what is no script of ours is data"
    );
    let own = own[0].split_once("</script>").expect("its end").0;
    let policy = html
        .split_once("Content-Security-Policy\" content=\"")
        .expect("a policy")
        .1;
    let policy = policy.split_once('"').expect("its end").0;
    let script = policy.split_once("script-src ").expect("whose scripts").1;
    assert_eq!(script.split(';').next(), Some(&*hash(own)), "{policy}");
    assert!(
        policy.starts_with("default-src 'none';") && policy.contains("connect-src 'none'"),
        "{policy}"
    );
    for drawing in html.split("points=\"").skip(1) {
        let points = drawing.split('"').next().unwrap();
        assert!(!points.contains(char::is_alphabetic), "{points:.100}");
    }
}
