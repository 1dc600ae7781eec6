//! The live page and the interactive top, compiled in -> answers. Pure.
//!
//! Hand-written HTML, CSS and ES modules below `src/web/`: no framework, nothing fetched from
//! elsewhere, no inline script or style, so that `default-src 'self'` can stand. They hold no secret
//! and are given without a token; what they ask for is not.

use super::http::answer::{refusal, response};
use axum::Router;
use axum::body::Body;
use axum::extract::Path;
use axum::http::{Response, StatusCode};
use axum::routing::get;

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const PICTURE: &str = "image/svg+xml";

macro_rules! assets {
    ($($name:literal $kind:ident),* $(,)?) => {
        &[$(($name, $kind, include_str!(concat!("../web/", $name)))),*]
    };
}

/// Name below `/page/`, type, text.
const ASSETS: &[(&str, &str, &str)] = assets![
    "style.css" STYLE,
    "icon.svg" PICTURE,
    "live.js" SCRIPT,
    "body3d.js" SCRIPT,
    "demonstration.js" SCRIPT,
    "history.js" SCRIPT,
    "horizon.js" SCRIPT,
    "known.js" SCRIPT,
    "link.js" SCRIPT,
    "numbers.js" SCRIPT,
    "playback.js" SCRIPT,
    "plot.js" SCRIPT,
    "quaternion.js" SCRIPT,
    "sensor.js" SCRIPT,
    "surface.js" SCRIPT,
    "top.js" SCRIPT,
    "topview.js" SCRIPT,
];

/// What the pages are made of.
pub(super) fn router() -> Router {
    Router::new()
        .route("/page/{name}", get(asset))
        .route("/top", get(top))
}

/// The live page.
pub(super) fn live() -> Response<Body> {
    response(StatusCode::OK, HTML, include_str!("../web/live.html"))
}

/// The interactive top.
async fn top() -> Response<Body> {
    response(StatusCode::OK, HTML, include_str!("../web/top.html"))
}

async fn asset(Path(name): Path<String>) -> Response<Body> {
    match ASSETS.iter().find(|(known, ..)| *known == name) {
        Some((_, kind, text)) => response(StatusCode::OK, kind, *text),
        None => refusal(
            StatusCode::NOT_FOUND,
            "not_found",
            "the page has no such part",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGES: [&str; 2] = [
        include_str!("../web/live.html"),
        include_str!("../web/top.html"),
    ];

    #[test]
    fn the_pages_are_small_and_ask_nobody_else() {
        let texts = || ASSETS.iter().map(|(.., text)| *text).chain(PAGES);
        let bytes: usize = texts().map(str::len).sum();
        assert!(bytes <= 150_000, "{bytes} bytes");
        for text in texts() {
            let elsewhere = text.replace("http://www.w3.org/2000/svg", "");
            for word in ["http://", "https://", "url(", "@import"] {
                // The scheme of one's own address is no address.
                let said = elsewhere.matches(word).count();
                assert_eq!(said, 0, "{word} in {}", &text[..60]);
            }
            for inline in ["<style", " style=", " onclick=", "<script>", "javascript:"] {
                assert!(!text.contains(inline), "{inline} in {}", &text[..60]);
            }
        }
    }

    #[test]
    fn every_part_a_page_names_is_there() {
        for page in PAGES {
            let named = page.split("\"/page/").skip(1);
            for name in named.filter_map(|rest| rest.split('"').next()) {
                assert!(ASSETS.iter().any(|(known, ..)| *known == name), "{name}");
            }
        }
        for (from, _, text) in ASSETS.iter().filter(|(_, kind, _)| *kind == SCRIPT) {
            let named = text.split("from \"./").skip(1);
            for name in named.filter_map(|rest| rest.split('"').next()) {
                assert!(
                    ASSETS.iter().any(|(known, ..)| *known == name),
                    "{from} imports {name}"
                );
            }
        }
    }
}
