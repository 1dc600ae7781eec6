//! HTTP connections -> their requests, admitted or refused. I/O.
//!
//! Apart from what is answered, since who may ask is decided here alone, before any route is looked at.

use super::stalling::Stalling;
use super::websocket::MAX_MESSAGE;
use super::{accept, prepare};
use crate::serve::core::context::Context;
use crate::serve::core::hub::count;
use crate::serve::edge::http::answer::refusal;
use crate::serve::edge::http::connection::Connection;
use crate::serve::edge::http::router;
use crate::serve::edge::samples::posters::Posters;
use crate::serve::guard::admission::{Denied, Foreign, Web};
use crate::serve::guard::log_throttle;
use crate::serve::guard::peer::Peer;
use crate::serve::guard::places::Kind;
use axum::body::Body;
use axum::http::{Request, Response, StatusCode, header};
use hyper::body::Incoming;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::net::IpAddr;
use std::pin::pin;
use std::sync::Arc;
use strapd_recording::text::printable;
use tokio::net::TcpListener;
use tokio::time::sleep;

pub(super) async fn serve(listener: TcpListener, context: Context) {
    let router = router();
    let posters = Arc::new(Posters::default());
    accept(
        context,
        Kind::Http,
        || listener.accept(),
        |(stream, peer), context, place| {
            prepare(&stream);
            // Of a listener on every address: the one that was asked. No name leads to it that is not allowed.
            let bound = stream
                .local_addr()
                .map_or(IpAddr::from([127, 0, 0, 1]), |a| a.ip().to_canonical());
            let place = Arc::new(place);
            let limits = *context.hub.limits();
            let stream = Stalling::new(stream, limits.no_progress, place.clone());
            let connection = Connection {
                hub: context.hub.clone(),
                peer: Peer::at("ws", peer),
                from: peer.ip().to_canonical(),
                posters: posters.clone(),
                trusted: false,
                is_own_page: false,
                running: context.running.clone(),
                reading: context.reading.clone(),
                place: place.clone(),
            };
            let (router, web) = (router.clone(), context.web.clone());
            let service = hyper::service::service_fn(move |request: Request<Incoming>| {
                answer(request, router.clone(), web.clone(), bound, connection.clone())
            });
            let mut running = context.running.clone();
            tokio::spawn(async move {
                let mut serving = pin!(
                    hyper::server::conn::http1::Builder::new()
                        .timer(TokioTimer::new())
                        .header_read_timeout(limits.first_line)
                        .max_buf_size(MAX_MESSAGE)
                        .serve_connection(TokioIo::new(stream), service)
                        .with_upgrades()
                );
                // What the peer does wrong is its own loss.
                tokio::select! {
                    _ = serving.as_mut() => {}
                    // Nobody waits for an answer any more, or takes it.
                    () = place.lost() => {}
                    () = running.asked() => {
                        serving.as_mut().graceful_shutdown();
                        let _ = serving.await;
                    }
                }
            });
        },
        |(stream, _), context, words| {
            let running = context.running.clone();
            tokio::spawn(async move {
                let head = format!(
                    "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
                    words.len()
                );
                let whole = [head.as_bytes(), &words].concat();
                super::duplex::dismiss(stream, whole.into()).await;
                drop(running);
            });
        },
    )
    .await;
}

/// Checks who asks, then lets the router answer.
async fn answer(
    mut request: Request<Incoming>,
    router: axum::Router,
    web: Arc<Web>,
    bound: IpAddr,
    mut connection: Connection,
) -> Result<Response<Body>, std::convert::Infallible> {
    use hyper::service::Service;
    let text = |name: header::HeaderName| {
        // Two of them, or one that is no text, is nobody we know.
        let mut values = request.headers().get_all(name).iter();
        match (values.next(), values.next()) {
            (None, _) => None,
            (Some(one), None) => Some(one.to_str().unwrap_or("?").to_owned()),
            _ => Some("?".to_owned()),
        }
    };
    let (host, origin) = (text(header::HOST), text(header::ORIGIN));
    // A target may name whom it is for by itself, and that then counts as Host does.
    let target = request.uri().authority().map(|name| name.as_str());
    let admitted = target
        .map_or(Ok(()), |name| web.admit(bound, Some(name), None))
        .and_then(|()| web.admit(bound, host.as_deref(), origin.as_deref()));
    if let Err(why) = admitted {
        count(&connection.hub.counters.refused, 1);
        warn_of(why, target.or(host.as_deref()), origin.as_deref());
        return Ok(refusal(StatusCode::FORBIDDEN, "forbidden", why.reason()));
    }
    connection.is_own_page = Web::is_own(host.as_deref(), origin.as_deref());
    if let (Some(token), Some(shown)) = (connection.hub.token(), text(header::AUTHORIZATION)) {
        let shown = shown.strip_prefix("Bearer ").unwrap_or_default();
        match token.judge(shown, connection.peer.address(), std::time::Instant::now()) {
            Ok(()) => {
                connection.trusted = true;
                connection.place.has_shown_token();
            }
            Err(Denied { fault, delay }) => {
                count(&connection.hub.counters.refused, 1);
                tokio::select! {
                    () = sleep(delay) => {}
                    () = connection.running.asked() => {}
                }
                return Ok(refusal(
                    StatusCode::UNAUTHORIZED,
                    fault.code,
                    &fault.message,
                ));
            }
        }
    }
    request.extensions_mut().insert(connection);
    let service = hyper_util::service::TowerToHyperService::new(router);
    service.call(request).await
}

/// Says in the log that a request was refused, for whoever wonders why a page shows nothing: no browser
/// shows the answer.
fn warn_of(why: Foreign, host: Option<&str>, origin: Option<&str>) {
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
