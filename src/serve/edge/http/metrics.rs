//! The counters of the daemon -> `/metrics`, as Prometheus reads them. Pure but for the turn that is waited for.

use super::answer::{response, unauthorised};
use super::connection::Connection;
use crate::serve::core::hub::Hub;
use crate::serve::core::outgoing;
use axum::body::Body;
use axum::extract::Extension;
use axum::http::{Response, StatusCode};
use std::collections::BTreeMap;
use std::fmt::Write;
use strapd_attitude::record::Verdict;

pub(super) async fn metrics(Extension(connection): Extension<Connection>) -> Response<Body> {
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
    attitudes(&mut out, hub, family);
    findings(&mut out, hub, family);
    outgoing::exposition(&mut out, hub.outgoing());
    out
}

/// Age, rate and uncertainty of each sensor: what an alert looks at.
fn attitudes(out: &mut String, hub: &Hub, family: impl Fn(&mut String, &str, &str, &str)) {
    family(
        out,
        "sensor_age_seconds",
        "gauge",
        "Seconds since something of a sensor came, in steps of a quarter of a second.",
    );
    hub.each_age(|id, secs| {
        let _ = writeln!(
            out,
            "strapd_sensor_age_seconds{{id=\"{}\"}} {secs}",
            label(id)
        );
    });
    family(
        out,
        "sensor_rate_hertz",
        "gauge",
        "Ordinary rate of a sensor by its stamps; the rate that comes is rate(strapd_sensor_samples_total).",
    );
    hub.each_sensor(|sensor| {
        if let Some(step) = sensor.conditioning().spacing_nanos.filter(|n| *n > 0) {
            let id = label(sensor.id());
            let _ = writeln!(
                out,
                "strapd_sensor_rate_hertz{{id=\"{id}\"}} {}",
                1e9 / step as f64
            );
        }
    });
    family(
        out,
        "sensor_sigma_degrees",
        "gauge",
        "One sigma of tilt and heading of a sensor that gravity corrects, as in STATUS.",
    );
    hub.each_sensor(|sensor| {
        let id = label(sensor.id());
        let sigmas = sensor.sigma_degrees().into_iter().flatten();
        for (of, sigma) in ["tilt", "heading"].into_iter().zip(sigmas) {
            let _ = writeln!(
                out,
                "strapd_sensor_sigma_degrees{{id=\"{id}\",of=\"{of}\"}} {sigma}"
            );
        }
    });
}

/// Number of findings that `STATUS` has of each sensor, by severity.
fn findings(out: &mut String, hub: &Hub, family: impl Fn(&mut String, &str, &str, &str)) {
    family(
        out,
        "sensor_findings",
        "gauge",
        "Findings about a sensor, as in STATUS, by severity.",
    );
    hub.each_sensor(|sensor| {
        let mut counts = BTreeMap::new();
        for finding in sensor.findings() {
            let severity = finding["severity"].as_str().unwrap_or_default().to_owned();
            *counts.entry(severity).or_insert(0) += 1;
        }
        let id = label(sensor.id());
        for (severity, n) in counts {
            let _ = writeln!(
                out,
                "strapd_sensor_findings{{id=\"{id}\",severity=\"{severity}\"}} {n}"
            );
        }
    });
}

/// A label's value; names come from outside.
fn label(text: &str) -> String {
    text.replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('\n', "\\n")
}
