//! `POST /reset` -> the hub: attitudes that begin anew, asked by a program that speaks HTTP and no more. I/O.
//!
//! Guarded as `POST /samples` is: no page of a browser posts, and with a token only who shows it.

use super::http::answer::{refusal, response};
use super::http::connection::Connection;
use super::samples::{Form, form, read, turned_away};
use crate::serve::core::hub::Asker;
use crate::serve::protocol::wire;
use axum::body::Body;
use axum::extract::Extension;
use axum::http::{Request, Response, StatusCode};

/// Answers a `POST`.
pub(in crate::serve) async fn post(
    Extension(connection): Extension<Connection>,
    request: Request<Body>,
) -> Response<Body> {
    let hub = &connection.hub;
    let (parts, body) = request.into_parts();
    let other_way =
        "resets are not taken from pages; the daemon's own page asks over its WebSocket";
    if let Some(refused) = turned_away(&connection, &parts, other_way) {
        return refused;
    }
    if !matches!(form(&parts.headers), Ok(Form::Json)) {
        let why = "the body must be Content-Type: application/json, an object such as {\"all\":true,\"heading\":0}";
        return refusal(StatusCode::UNSUPPORTED_MEDIA_TYPE, "body_type", why);
    }
    let body = match read(&connection, &parts.headers, body).await {
        Ok(body) => body,
        Err(refused) => return refused,
    };
    match hub.reset(wire::posted_reset(&body), Asker::OwnPage) {
        Ok((asked, done)) => response(
            StatusCode::OK,
            "application/json",
            wire::reset_answer(&asked, &done),
        ),
        Err(fault) => {
            let status = match fault.code {
                "unknown_sensor" => StatusCode::NOT_FOUND,
                "reset_not_taken" => StatusCode::CONFLICT,
                _ => StatusCode::BAD_REQUEST,
            };
            response(status, "application/json", wire::error(&fault, 0, &[], 0))
        }
    }
}
