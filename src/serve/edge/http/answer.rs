//! Answer -> a response with the headers that all of them have. Pure.

use crate::sink::UNAUTHORISED;
use axum::body::Body;
use axum::http::{HeaderValue, Response, StatusCode, header};

/// An answer that says no, as JSON.
pub(in crate::serve) fn refusal(status: StatusCode, code: &str, message: &str) -> Response<Body> {
    let text = serde_json::json!({"class": "ERROR", "code": code, "message": message});
    response(status, "application/json", format!("{text}\n"))
}

/// An answer with the headers all of them have.
pub(in crate::serve) fn response(
    status: StatusCode,
    kind: &'static str,
    text: impl Into<Body>,
) -> Response<Body> {
    let mut response = Response::new(text.into());
    *response.status_mut() = status;
    for (name, value) in [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (
            header::CONTENT_SECURITY_POLICY,
            "default-src 'self'; base-uri 'none'; frame-ancestors 'none'",
        ),
        (header::REFERRER_POLICY, "no-referrer"),
    ] {
        response
            .headers_mut()
            .insert(name, HeaderValue::from_static(value));
    }
    response
}

/// The answer to who has not shown the token.
pub(in crate::serve) fn unauthorised() -> Response<Body> {
    refusal(
        StatusCode::UNAUTHORIZED,
        UNAUTHORISED,
        "Authorization: Bearer TOKEN is needed",
    )
}
