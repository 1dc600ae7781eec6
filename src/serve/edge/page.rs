//! The live page and the interactive top, compiled in -> answers. Pure.
//!
//! No inline script or style, so that `default-src 'self'` can stand. They hold no secret and are given
//! without a token; what they ask for is not.

use super::http::answer::{refusal, response};
use crate::web;
use axum::Router;
use axum::body::Body;
use axum::extract::Path;
use axum::http::{Response, StatusCode};
use axum::routing::get;

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const PICTURE: &str = "image/svg+xml";

/// The type of a file, by its name.
fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, ending)| ending) {
        "css" => STYLE,
        "svg" => PICTURE,
        "html" => HTML,
        _ => SCRIPT,
    }
}

/// Router of the pages.
pub(in crate::serve) fn router() -> Router {
    Router::new()
        .route("/page/{name}", get(asset))
        .route("/top", get(top))
}

/// The live page.
pub(in crate::serve) fn live() -> Response<Body> {
    page("live.html")
}

/// The interactive top.
async fn top() -> Response<Body> {
    page("top.html")
}

fn page(name: &'static str) -> Response<Body> {
    response(StatusCode::OK, HTML, web::text(name).unwrap_or_default())
}

async fn asset(Path(name): Path<String>) -> Response<Body> {
    match web::text(&name).filter(|_| kind(&name) != HTML) {
        Some(text) => response(StatusCode::OK, kind(&name), text),
        None => refusal(
            StatusCode::NOT_FOUND,
            "not_found",
            "the page has no such part",
        ),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const PAGES: [&str; 2] = ["live.html", "top.html"];

    fn text(name: &str) -> &'static str {
        web::text(name).unwrap_or_default()
    }

    #[test]
    fn the_pages_are_small_and_ask_nobody_else() {
        let bytes: usize = web::names().map(|name| text(name).len()).sum();
        assert!((60_000..=200_000).contains(&bytes), "{bytes} bytes");
        for name in web::names() {
            let text = text(name);
            let elsewhere = text.replace("http://www.w3.org/2000/svg", "");
            for word in ["http://", "https://", "url(", "@import"] {
                // The scheme of one's own address is no address.
                let said = elsewhere.matches(word).count();
                assert_eq!(said, 0, "{word} in {name}");
            }
            for inline in ["<style", " style=", " onclick=", "<script>", "javascript:"] {
                assert!(!text.contains(inline), "{inline} in {name}");
            }
        }
    }

    #[test]
    fn every_part_a_page_names_is_there() {
        for page in PAGES {
            for name in text(page).split("\"/page/").skip(1) {
                let name = name.split('"').next().unwrap_or_default();
                assert!(web::text(name).is_some(), "{page} names {name}");
            }
        }
        for from in web::names().filter(|name| kind(name) == SCRIPT) {
            for name in text(from).split("from \"./").skip(1) {
                let name = name.split('"').next().unwrap_or_default();
                assert!(web::text(name).is_some(), "{from} imports {name}");
            }
        }
    }
}
