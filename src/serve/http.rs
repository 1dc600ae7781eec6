//! HTTP requests -> the pages, state of the daemon, or a WebSocket. I/O.

use super::admission::Foreign;
use super::foxglove::SUBPROTOCOLS;
use super::hub::{Hub, count};
use super::listen::{Connection, websocket};
use super::places::Kind;
use super::{log_throttle, page, samples, top_page};
use axum::Router;
use axum::body::Body;
use axum::extract::Extension;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::{HeaderMap, HeaderValue, Response, StatusCode, header};
use axum::routing::{get, post};
use std::fmt::Write;
use strapd_attitude::record::Verdict;
use strapd_recording::text::printable;

/// Lines, where a client names what it speaks.
const OWN_SUBPROTOCOL: &str = "strapd.v1";

/// Everything that is answered.
pub(crate) fn router() -> Router {
    Router::new()
        .route("/", get(root))
        .route("/ws", get(upgrade))
        .route("/healthz", get(health))
        .route("/metrics", get(metrics))
        .route(
            "/samples",
            post(samples::post).fallback(samples::not_posted),
        )
        .merge(page::router())
        .route("/model/top", get(top_page::answer))
        .fallback(|| async {
            refusal(
                StatusCode::NOT_FOUND,
                "not_found",
                "there are /, /top, /ws, /samples, /healthz and /metrics",
            )
        })
}

/// The live page, or a WebSocket for who asks for one.
async fn root(
    connection: Extension<Connection>,
    headers: HeaderMap,
    socket: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response<Body> {
    if headers.contains_key(header::UPGRADE) {
        upgrade(connection, headers, socket).await
    } else {
        page::live()
    }
}

async fn upgrade(
    Extension(connection): Extension<Connection>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response<Body> {
    let spoken = subprotocol(&headers);
    let foxglove = SUBPROTOCOLS.iter().position(|known| Some(*known) == spoken);
    let foxglove = foxglove.map(|known| known == 0);
    match upgrade {
        Ok(_) if foxglove.is_some() && connection.hub.token().is_some() && !connection.trusted => {
            // Its first message can show no token.
            unauthorised()
        }
        Ok(upgrade) => {
            // From now on it converses, and needs another place.
            let is_known = connection.trusted || connection.hub.token().is_none();
            let kind = if is_known {
                Kind::Served
            } else {
                Kind::Unproven
            };
            if let Err(fault) = connection.place.become_of(kind, connection.trusted) {
                count(&connection.hub.counters.refused, 1);
                return refusal(StatusCode::SERVICE_UNAVAILABLE, fault.code, &fault.message);
            }
            upgrade
                .protocols(spoken)
                .max_message_size(websocket::MAX_MESSAGE)
                .max_frame_size(websocket::MAX_MESSAGE)
                .read_buffer_size(websocket::READ_BUFFER)
                .write_buffer_size(websocket::WRITE_BUFFER)
                .max_write_buffer_size(websocket::MAX_WRITE_BUFFER)
                .on_upgrade(move |socket| websocket::converse(socket, connection, foxglove))
        }
        Err(_) => refusal(
            StatusCode::UPGRADE_REQUIRED,
            "upgrade_required",
            "this is a WebSocket; docs/protocol.md says how to talk to it",
        ),
    }
}

/// The first of the sub-protocols a client offers that we speak.
fn subprotocol(headers: &HeaderMap) -> Option<&'static str> {
    headers
        .get_all(header::SEC_WEBSOCKET_PROTOCOL)
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .find_map(|offered| {
            let mut known = SUBPROTOCOLS.into_iter().chain([OWN_SUBPROTOCOL]);
            known.find(|known| *known == offered.trim())
        })
}

/// Says in the log that a request was refused, for whoever wonders why a page shows nothing: no browser
/// shows the answer.
pub(crate) fn warn_of(why: Foreign, host: Option<&str>, origin: Option<&str>) {
    let named = |name: Option<&str>| printable(name.unwrap_or_default());
    match why {
        Foreign::NoHost => {}
        Foreign::Host => log_throttle::warn(
            "foreign host",
            &format!(
                "a request for the host {} was refused; --allow-host allows it",
                named(host)
            ),
        ),
        Foreign::Origin if origin == Some("null") => log_throttle::warn(
            "foreign origin",
            "a page from a file (origin null) was refused; serve it over HTTP, and --allow-origin with that address allows it",
        ),
        Foreign::Origin => log_throttle::warn(
            "foreign origin",
            &format!(
                "pages of {origin} were refused; --allow-origin {origin} allows them",
                origin = named(origin)
            ),
        ),
    }
}

pub(super) fn unauthorised() -> Response<Body> {
    refusal(
        StatusCode::UNAUTHORIZED,
        "unauthorised",
        "Authorization: Bearer TOKEN is needed",
    )
}

/// Whether samples are taken: 200, or 503 while shutting down.
async fn health(Extension(connection): Extension<Connection>) -> Response<Body> {
    if connection.hub.is_stopping() {
        return response(
            StatusCode::SERVICE_UNAVAILABLE,
            "text/plain; charset=utf-8",
            "stopping\n",
        );
    }
    response(StatusCode::OK, "text/plain; charset=utf-8", "ok\n")
}

async fn metrics(Extension(connection): Extension<Connection>) -> Response<Body> {
    if connection.hub.token().is_some() && !connection.trusted {
        return unauthorised();
    }
    // One after another, with all who ask for much.
    let _turn = connection.hub.turn(true).await;
    response(
        StatusCode::OK,
        "text/plain; version=0.0.4; charset=utf-8",
        exposition(&connection.hub),
    )
}

/// The counters as Prometheus text, written here: a dozen numbers need no registry.
fn exposition(hub: &Hub) -> String {
    let mut out = String::new();
    let family = |out: &mut String, name: &str, kind: &str, help: &str| {
        // A String takes every write.
        let _ = write!(
            out,
            "# HELP strapd_{name} {help}\n# TYPE strapd_{name} {kind}\n"
        );
    };
    family(
        &mut out,
        "uptime_seconds",
        "gauge",
        "Seconds since the start.",
    );
    let _ = writeln!(out, "strapd_uptime_seconds {}", hub.uptime_secs());
    family(
        &mut out,
        "connections",
        "gauge",
        "Who converses now: connections but those of plain HTTP, senders of datagrams, addresses that post, and whom the daemon connects to.",
    );
    let _ = writeln!(out, "strapd_connections {}", hub.connected());
    for counter in hub.counters.named() {
        let name = format!("{}_total", counter.name);
        family(&mut out, &name, "counter", counter.counts);
        let _ = writeln!(out, "strapd_{name} {}", counter.value);
    }
    let (mut queued, mut dropped) = (0, 0);
    hub.each_client(|client| {
        let level = client.outbox.level();
        queued += level.queued;
        dropped += level.dropped;
    });
    family(
        &mut out,
        "queued_bytes",
        "gauge",
        "Bytes of attitudes and samples waiting for those connected now, or being written to them.",
    );
    let _ = writeln!(out, "strapd_queued_bytes {queued}");
    family(
        &mut out,
        "dropped_attitudes",
        "gauge",
        "Attitudes that those connected now were too slow for; less again when one of them goes.",
    );
    let _ = writeln!(out, "strapd_dropped_attitudes {dropped}");
    family(
        &mut out,
        "sensor_samples_total",
        "counter",
        "Samples by sensor and verdict; a line that could not be read counts for the sensor sent before it.",
    );
    hub.each_sensor(|sensor| {
        let id = label(sensor.id());
        for verdict in Verdict::ALL {
            let n = sensor.conditioning().counts.get(verdict);
            if n > 0 {
                let _ = writeln!(
                    out,
                    "strapd_sensor_samples_total{{id=\"{id}\",verdict=\"{}\"}} {n}",
                    verdict.name()
                );
            }
        }
    });
    family(
        &mut out,
        "sensor_gaps_total",
        "counter",
        "Gaps by sensor, bridged ones and jumps of the clock among them.",
    );
    hub.each_sensor(|sensor| {
        let n = sensor.conditioning().gaps.count;
        let _ = writeln!(
            out,
            "strapd_sensor_gaps_total{{id=\"{}\"}} {n}",
            label(sensor.id())
        );
    });
    super::connect::exposition(&mut out, hub);
    out
}

/// A label's value; names come from outside.
fn label(text: &str) -> String {
    text.replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('\n', "\\n")
}

/// An answer that says no, as JSON.
pub(crate) fn refusal(status: StatusCode, code: &str, message: &str) -> Response<Body> {
    let text = serde_json::json!({"class": "ERROR", "code": code, "message": message});
    response(status, "application/json", format!("{text}\n"))
}

/// An answer with the headers all of them have.
pub(super) fn response(
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
