//! HTTP requests -> the pages, state of the daemon, or a WebSocket. I/O.

pub(in crate::serve) mod answer;
pub(in crate::serve) mod connection;
mod metrics;
mod overview;

use super::listen::websocket;
use super::{page, resets, samples, top_page};
use crate::serve::guard::places::Kind;
use crate::serve::protocol::foxglove::SUBPROTOCOLS;
use answer::{refusal, response, unauthorised};
use axum::Router;
use axum::body::Body;
use axum::extract::Extension;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::{HeaderMap, Response, StatusCode, header};
use axum::routing::{get, post};
use connection::Connection;

/// Lines, where a client names what it speaks.
const OWN_SUBPROTOCOL: &str = "strapd.v1";

/// Everything that is answered.
pub(crate) fn router() -> Router {
    Router::new()
        .route("/", get(root))
        .route("/ws", get(upgrade))
        .route("/healthz", get(health))
        .route("/metrics", get(metrics::metrics))
        .route("/overview", get(overview::overview))
        .route(
            "/samples",
            post(samples::post).fallback(samples::not_posted),
        )
        .route("/reset", post(resets::post).fallback(samples::not_posted))
        .merge(page::router())
        .route("/model/top", get(top_page::answer))
        .fallback(|| async {
            refusal(
                StatusCode::NOT_FOUND,
                "not_found",
                "there are /, /top, /ws, /samples, /reset, /overview, /model/top, /healthz and /metrics",
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
                connection.hub.turned_away(&fault);
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

/// Whether samples are taken: 200, or 503 while shutting down; and what else does not go on.
async fn health(Extension(connection): Extension<Connection>) -> Response<Body> {
    if connection.hub.is_stopping() {
        return response(
            StatusCode::SERVICE_UNAVAILABLE,
            "text/plain; charset=utf-8",
            "stopping\n",
        );
    }
    // Samples are taken, whatever else does not go on: who restarts it for that loses them.
    let troubles = connection.hub.troubles();
    let mut text = "ok\n".to_owned();
    for trouble in troubles {
        text.push_str(&format!("but {trouble}\n"));
    }
    response(StatusCode::OK, "text/plain; charset=utf-8", text)
}
