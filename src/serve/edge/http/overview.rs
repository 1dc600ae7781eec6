//! `GET /overview`: curves of the whole recording that is played, or of a part of it. Pure but for the turn that is
//! waited for.

use super::answer::{refusal, response, unauthorised};
use super::connection::Connection;
use crate::serve::protocol::position::Part;
use axum::body::Body;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Extension, Query};
use axum::http::{Response, StatusCode};
use serde::Deserialize;
use strapd_attitude::record::Nanos;

/// Points of each stream that are answered if nobody says how many, and at most.
const POINTS: usize = 2000;
const MOST_POINTS: usize = 8000;

/// Query.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    /// First stamp, `SEC.NSEC` with nine digits.
    from: Option<String>,
    /// Last stamp.
    to: Option<String>,
    points: Option<usize>,
}

/// A stamp as `SEC.NSEC` with nine digits.
fn stamp(text: &str) -> Option<Nanos> {
    let (sec, nsec) = text.split_once('.')?;
    let digits = nsec.len() == 9 && nsec.bytes().all(|b| b.is_ascii_digit());
    let nsec = nsec.parse().ok().filter(|_| digits)?;
    let sec: i64 = sec.parse().ok()?;
    Some(Nanos(sec.checked_mul(1_000_000_000)?.checked_add(nsec)?))
}

fn part(asked: &Asked) -> Result<Part, &'static str> {
    let read = |text: &Option<String>| match text {
        None => Ok(None),
        Some(text) => stamp(text)
            .map(Some)
            .ok_or("from, to: SEC.NSEC with nine digits after the point"),
    };
    let points = asked.points.unwrap_or(POINTS);
    if !(2..=MOST_POINTS).contains(&points) {
        return Err("points: from 2 to 8000 are allowed");
    }
    Ok(Part {
        from: read(&asked.from)?,
        to: read(&asked.to)?,
        points,
    })
}

pub(super) async fn overview(
    Extension(connection): Extension<Connection>,
    asked: Result<Query<Asked>, QueryRejection>,
) -> Response<Body> {
    let hub = &connection.hub;
    if hub.token().is_some() && !connection.trusted {
        return unauthorised();
    }
    let part = match asked {
        Ok(Query(asked)) => part(&asked).map_err(str::to_owned),
        Err(rejection) => Err(rejection.body_text()),
    };
    let part = match part {
        Ok(part) => part,
        Err(why) => return refusal(StatusCode::BAD_REQUEST, "bad_overview", &why),
    };
    // One after another, with all who ask for much.
    let _turn = hub.turn(true).await;
    match hub.overview(&part) {
        Some(value) => response(StatusCode::OK, "application/json", value.to_string()),
        None => refusal(
            StatusCode::NOT_FOUND,
            "no_overview",
            "only a recording that is replayed with a page has one",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_read_to_the_nanosecond_or_refused() {
        let asked = |from: &str, points| Asked {
            from: Some(from.to_owned()),
            to: None,
            points,
        };
        let read = part(&asked("1700000051.040000001", None));
        let from = read.map(|part| (part.from, part.points));
        assert_eq!(from, Ok((Some(Nanos(1_700_000_051_040_000_001)), POINTS)));
        for bad in [
            "",
            "5",
            "5.1",
            "5.-00000001",
            "9999999999999.000000000",
            "x.000000000",
        ] {
            assert!(part(&asked(bad, None)).is_err(), "{bad}");
        }
        assert!(part(&asked("1.000000000", Some(1_000_000))).is_err());
    }
}
