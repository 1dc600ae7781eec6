//! `POST /samples` -> the hub: samples from whoever can speak HTTP and no more, such as a phone. I/O.
//!
//! A page of anybody can make a browser send a `POST`. So whatever a browser alone sends with it
//! (`Origin`, `Sec-Fetch-Site`) refuses it, and only bodies of types are taken that no page can send
//! elsewhere without having asked first.

pub(super) mod posters;

use super::http::answer::{refusal, unauthorised};
use super::http::connection::Connection;
use crate::serve::core::hub::count;
use crate::serve::core::read_buffer::now;
use crate::serve::guard::log_throttle;
use axum::body::Body;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Extension, Query};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, Request, Response, StatusCode, header};
use futures_util::StreamExt;
use posters::MAX_POSTERS;
use serde::Deserialize;
use strapd_recording::decode::{Objects, exact_name};
use strapd_recording::text::printable;
use tokio::time::timeout;

/// Longest body.
const MAX_BODY: usize = 1 << 20;

/// Query that the address may have.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::serve) struct SamplesQuery {
    /// Names the sensor where an object does not.
    id: Option<String>,
}

/// Form in which a body holds its objects.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    Json,
    Lines,
}

/// Answers a `POST`.
pub(in crate::serve) async fn post(
    Extension(connection): Extension<Connection>,
    asked: Result<Query<SamplesQuery>, QueryRejection>,
    request: Request<Body>,
) -> Response<Body> {
    let hub = &connection.hub;
    let (parts, body) = request.into_parts();
    let other_way =
        "samples are not taken from pages; a page may send them over a WebSocket at /ws";
    if let Some(refused) = turned_away(&connection, &parts, other_way) {
        return refused;
    }
    let is_text = parts.uri.query().is_none_or(is_text);
    let name = match asked {
        _ if !is_text => {
            let why = "the address holds bytes that are no UTF-8, so that two names would be one";
            return refusal(StatusCode::BAD_REQUEST, "bad_id", why);
        }
        Ok(Query(asked)) => match asked.id.as_deref().map(exact_name).transpose() {
            Ok(name) => name.filter(|id| !id.is_empty()),
            Err(why) => {
                return refusal(StatusCode::BAD_REQUEST, "bad_id", &why.to_string());
            }
        },
        Err(_) => {
            let why = "the address may say ?id=NAME, once, and nothing else";
            return refusal(StatusCode::BAD_REQUEST, "bad_request", why);
        }
    };
    let form = match form(&parts.headers) {
        Ok(form) => form,
        Err(why) => return refusal(StatusCode::UNSUPPORTED_MEDIA_TYPE, "body_type", &why),
    };
    let body = match read(&connection, &parts.headers, body).await {
        Ok(body) => body,
        Err(refused) => return refused,
    };
    if hub.is_stopping() {
        let why = "the daemon is shutting down";
        return refusal(StatusCode::SERVICE_UNAVAILABLE, "stopping", why);
    }
    let Some(poster) = connection.posters.find(hub, connection.from) else {
        count(&hub.counters.refused, 1);
        let why = format!("{MAX_POSTERS} addresses post already");
        return refusal(StatusCode::SERVICE_UNAVAILABLE, "too_many_clients", &why);
    };
    let objects = match form {
        Form::Json => Objects::json(&body),
        Form::Lines => Objects::lines(&body),
    };
    let taken = poster
        .lock()
        .await
        .take(objects, name.as_deref(), now())
        .await;
    taken.answer()
}

/// Whether the bytes that a query stands for are UTF-8.
fn is_text(query: &str) -> bool {
    let mut bytes = Vec::with_capacity(query.len());
    let mut rest = query.as_bytes();
    while let Some((first, behind)) = rest.split_first() {
        let digits = behind.get(..2).filter(|_| *first == b'%');
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        let escaped = digits.and_then(|digits| {
            let are_hex = digits.bytes().all(|b| b.is_ascii_hexdigit());
            u8::from_str_radix(digits, 16).ok().filter(|_| are_hex)
        });
        bytes.push(escaped.unwrap_or(*first));
        rest = match escaped {
            Some(_) => behind.get(2..).unwrap_or_default(),
            None => behind,
        };
    }
    std::str::from_utf8(&bytes).is_ok()
}

/// Answer to any other method.
pub(super) async fn not_posted() -> Response<Body> {
    let mut refused = refusal(
        StatusCode::METHOD_NOT_ALLOWED,
        "method_not_allowed",
        "this takes POST; docs/protocol.md says how",
    );
    let allowed = axum::http::HeaderValue::from_static("POST");
    refused.headers_mut().insert(header::ALLOW, allowed);
    refused
}

/// Answer to who may not post: a page of a browser, which is told the other way, and with a token who does not show it.
pub(super) fn turned_away(
    connection: &Connection,
    parts: &Parts,
    other_way: &str,
) -> Option<Response<Body>> {
    let hub = &connection.hub;
    if let Err(why) = no_page(&parts.headers) {
        count(&hub.counters.refused, 1);
        let path = printable(parts.uri.path());
        log_throttle::warn(
            "a page posts",
            &format!("POST {path}, from a page: refused ({why})"),
        );
        return Some(refusal(StatusCode::FORBIDDEN, "forbidden", other_way));
    }
    if hub.token().is_some() && !connection.trusted {
        return Some(unauthorised());
    }
    None
}

/// Whether no browser's page can have sent this.
fn no_page(headers: &HeaderMap) -> Result<(), String> {
    if let Some(origin) = headers.get(header::ORIGIN) {
        let origin = String::from_utf8_lossy(origin.as_bytes());
        return Err(format!("Origin {}", printable(&origin)));
    }
    let site = HeaderName::from_static("sec-fetch-site");
    match headers.get_all(site).iter().find(|site| *site != "none") {
        None => Ok(()),
        Some(site) => {
            let site = String::from_utf8_lossy(site.as_bytes());
            Err(format!("Sec-Fetch-Site {}", printable(&site)))
        }
    }
}

/// Form that the headers state of the body.
pub(super) fn form(headers: &HeaderMap) -> Result<Form, String> {
    let mut types = headers.get_all(header::CONTENT_TYPE).iter();
    let said = match (types.next(), types.next()) {
        (Some(one), None) => one.to_str().unwrap_or_default(),
        _ => "",
    };
    let kind = said.split(';').next().unwrap_or_default().trim();
    match () {
        () if kind.eq_ignore_ascii_case("application/json") => Ok(Form::Json),
        () if kind.eq_ignore_ascii_case("application/x-ndjson") => Ok(Form::Lines),
        () => Err("the body must be Content-Type: application/json (an object, or an array of them) or application/x-ndjson (an object on each line)".to_owned()),
    }
}

/// The whole body, if it comes in time and is not too long.
pub(super) async fn read(
    connection: &Connection,
    headers: &HeaderMap,
    body: Body,
) -> Result<Vec<u8>, Response<Body>> {
    let limits = connection.hub.limits();
    let too_long = || {
        let why = format!("a body may have {MAX_BODY} bytes: send it in several");
        refusal(StatusCode::PAYLOAD_TOO_LARGE, "body_too_long", &why)
    };
    let stated = headers.get(header::CONTENT_LENGTH);
    let stated = stated.and_then(|n| n.to_str().ok()?.parse::<u64>().ok());
    if stated.is_some_and(|n| n > MAX_BODY as u64) {
        return Err(too_long());
    }
    let mut whole = Vec::new();
    let mut pieces = body.into_data_stream();
    let reading = async {
        loop {
            match timeout(limits.no_progress, pieces.next()).await {
                Ok(None) => return Some(true),
                Ok(Some(Ok(piece))) if whole.len() + piece.len() <= MAX_BODY => {
                    whole.extend_from_slice(&piece);
                }
                Ok(Some(Ok(_))) => return Some(false),
                Ok(Some(Err(_))) | Err(_) => return None,
            }
        }
    };
    match timeout(limits.idle, reading).await {
        Ok(Some(true)) => Ok(whole),
        Ok(Some(false)) => Err(too_long()),
        Ok(None) | Err(_) => {
            let why = "the body did not come in time, or not whole; nothing of it was taken";
            Err(refusal(StatusCode::REQUEST_TIMEOUT, "body_timeout", why))
        }
    }
}
