//! Knowledge -> lines of text. Pure: time is given. Everything that came from a daemon was made
//! fit for a terminal when it was read.

use super::board::{Board, LinkState, Sensor};
use super::horizon::horizon;
use crate::sink::roll_pitch_yaw;
use std::time::{Duration, Instant};
use strapd_recording::attitude_line::Attitude;
use strapd_recording::text::printable;

/// The horizon's size in characters.
const PICTURE: (usize, usize) = (21, 7);
/// Below this width there is no room for a picture.
const WIDE: usize = 84;
/// Silence after which a sensor is marked, as on the page, and stands behind those that speak, in one line.
const SILENT: Duration = Duration::from_secs(5);
/// Text for a sensor that has said nothing to us.
const NEVER_HEARD: &str = "silent since this watch began";
/// Text for one of which the last attitude of before we came is all there is.
const ENDED: &str = "ended, silent since this watch began";
/// Longest name that is shown whole.
const MAX_NAME: usize = 48;

/// Tone of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Heading,
    Alarm,
    /// Tone of a sensor that is silent, or has ended.
    Silent,
    /// Columns where the figures of x, y and z begin, and where that of z ends, in characters.
    Axes([usize; 4]),
}

/// A line of text.
pub(super) type Line = (Tone, String);

/// The first line: where, and how the connection stands.
pub(super) fn heading(board: &Board, now: Instant) -> Line {
    let sensors = board.sensors.len();
    let (tone, state) = match &board.link {
        LinkState::Connecting => (Tone::Heading, "connecting".to_owned()),
        LinkState::Connected(since) => (
            Tone::Heading,
            format!(
                "connected {}",
                lasting(now.saturating_duration_since(*since))
            ),
        ),
        LinkState::Lost(since, why) => (
            Tone::Alarm,
            format!(
                "NOT CONNECTED for {}, trying again: {why}",
                lasting(now.saturating_duration_since(*since))
            ),
        ),
    };
    let plural = if sensors == 1 { "" } else { "s" };
    let silent = match board.sensors.values().filter(|s| is_silent(s, now)).count() {
        0 => String::new(),
        n => format!(", {n} silent"),
    };
    (
        tone,
        format!(
            "strapd watch {}  {sensors} sensor{plural}{silent}  {state}",
            board.name
        ),
    )
}

/// The last line.
pub(super) fn footing(board: &Board) -> Line {
    match &board.complaint {
        Some(what) => (Tone::Alarm, format!("q quits; the daemon says {what}")),
        None => (Tone::Plain, "q quits; up and down scroll".to_owned()),
    }
}

/// Everything between them, for a terminal so many characters wide.
pub(super) fn body(board: &Board, now: Instant, width: usize) -> Vec<Line> {
    if board.sensors.is_empty() {
        return vec![(Tone::Plain, "nothing has come yet".to_owned())];
    }
    let mut lines = Vec::new();
    let all_are = board.sensors.values().all(|s| is_silent(s, now));
    // Of one without an attitude there is nothing to unfold.
    let (folded, shown): (Vec<_>, Vec<_>) = board
        .sensors
        .iter()
        .partition(|(_, sensor)| is_silent(sensor, now) && (!all_are || sensor.attitude.is_none()));
    for (id, sensor) in shown {
        lines.push((tone(sensor, now), title(id, sensor, now)));
        let figures = figures(sensor, now);
        if width < WIDE {
            lines.extend(figures.into_iter().map(|line| behind("  ", line)));
        } else {
            let (columns, rows) = PICTURE;
            let rows = rows.max(figures.len());
            let picture = match &sensor.attitude {
                Some(a) => horizon(a.q, &a.world, &a.body, columns, rows),
                None => vec![" ".repeat(columns); rows],
            };
            for (n, row) in picture.iter().enumerate() {
                let figure = figures.get(n).cloned();
                let figure = figure.unwrap_or((Tone::Plain, String::new()));
                lines.push(behind(&format!("  |{row}|  "), figure));
            }
        }
        lines.push((Tone::Plain, String::new()));
    }
    for (id, sensor) in folded {
        let said = match silence(sensor, now) {
            Some(time) => format!("{}  silent for {}", shortened(id), lasting(time)),
            None => title(id, sensor, now),
        };
        let angles = sensor.attitude.as_ref().map(|a| format!("  {}", angles(a)));
        lines.push((Tone::Silent, said + &angles.unwrap_or_default()));
    }
    lines
}

/// Time since it was heard; `None`: it never was.
fn silence(sensor: &Sensor, now: Instant) -> Option<Duration> {
    let heard = sensor.heard?;
    Some(now.saturating_duration_since(heard))
}

/// Whether it says nothing just now.
fn is_silent(sensor: &Sensor, now: Instant) -> bool {
    silence(sensor, now).is_none_or(|time| time > SILENT)
}

/// The same behind other characters.
fn behind(before: &str, (tone, text): Line) -> Line {
    let by = before.chars().count();
    let tone = match tone {
        Tone::Axes(places) => Tone::Axes(places.map(|place| place + by)),
        other => other,
    };
    (tone, before.to_owned() + &text)
}

/// Three figures in the colours of the axes, with what stands before and behind them.
fn axes(before: &str, figures: [String; 3], after: &str) -> Line {
    let mut text = before.to_owned();
    let mut places = [text.chars().count(); 4];
    for (place, figure) in places.iter_mut().skip(1).zip(figures) {
        text += &figure;
        *place = text.chars().count();
    }
    (Tone::Axes(places), text + after)
}

fn angles(attitude: &Attitude) -> String {
    let [roll, pitch, yaw] = roll_pitch_yaw(attitude.q)
        .map(f64::to_degrees)
        .map(|v| figure(v, 9, 3));
    format!("roll {roll}  pitch {pitch}  yaw {yaw}  deg")
}

/// Tone of a sensor's title: whether it is silent, or something else is wrong with it now.
fn tone(sensor: &Sensor, now: Instant) -> Tone {
    if is_silent(sensor, now) {
        return Tone::Silent;
    }
    match &sensor.attitude {
        Some(a) if unusual(a).next().is_some() => Tone::Alarm,
        _ => Tone::Heading,
    }
}

/// Words of a status that are worth a look.
fn unusual(attitude: &Attitude) -> impl Iterator<Item = &str> {
    let words = attitude.status.iter().map(String::as_str);
    words.filter(|word| !matches!(*word, "ok" | "provisional" | "aided" | "rest"))
}

fn title(id: &str, sensor: &Sensor, now: Instant) -> String {
    let Some(a) = &sensor.attitude else {
        return format!("{}  {NEVER_HEARD}", shortened(id));
    };
    let mut title = format!("{}  {} in {}", shortened(id), a.body, a.world);
    // That it was the last is said by what is said of its silence.
    for word in unusual(a).filter(|word| *word != "last") {
        title += &format!("  {word}");
    }
    match silence(sensor, now) {
        None => title += &format!("  {ENDED}"),
        Some(time) if time > SILENT => title += &format!("  silent for {}", lasting(time)),
        Some(_) => {}
    }
    title
}

fn shortened(id: &str) -> String {
    match id.char_indices().nth(MAX_NAME) {
        Some((at, _)) => format!("{}~", id.get(..at).unwrap_or_default()),
        None => id.to_owned(),
    }
}

/// The figures of one sensor, a line each.
fn figures(sensor: &Sensor, now: Instant) -> Vec<Line> {
    let mut lines = Vec::new();
    if let Some(a) = &sensor.attitude {
        let [roll, pitch, yaw] = roll_pitch_yaw(a.q)
            .map(f64::to_degrees)
            .map(|v| figure(v, 9, 3));
        let [w, x, y, z] = a.q.map(|v| figure(v, 10, 6));
        let [p, q, r] = a.rate.map(|v| figure(v.to_degrees(), 9, 3));
        let [sx, sy, sz] = a.sigma_deg.map(|v| figure(v, 9, 3).replace('+', " "));
        let (sec, nsec) = a.stamp.unwrap_or_default().to_sec_nanosec();
        let three = |names: [&str; 3], [x, y, z]: [String; 3]| {
            let [a, b, c] = names;
            [format!("{a}{x}"), format!("{b}{y}"), format!("{c}{z}")]
        };
        lines.push(axes(
            "",
            three(["roll ", "  pitch ", "  yaw "], [roll, pitch, yaw]),
            "  deg",
        ));
        lines.push(axes(
            &format!("q  w{w}  "),
            three(["x", "  y", "  z"], [x, y, z]),
            "",
        ));
        lines.push(axes(
            "rate ",
            three(["x", "  y", "  z"], [p, q, r]),
            "  deg/s",
        ));
        lines.push(axes(
            "sigma ",
            three(["", "   ", "   "], [sx, sy, sz]),
            "  deg (1 sigma, x y z)",
        ));
        lines.extend(
            knowledge(sensor)
                .into_iter()
                .map(|text| (Tone::Plain, text)),
        );
        lines.push((
            Tone::Plain,
            format!("stamp {sec}.{nsec:09}  seq {}  resets {}", a.seq, a.reset),
        ));
    }
    let h = &sensor.health;
    let rate = rate(sensor);
    let jitter = h
        .jitter_s
        .map_or_else(String::new, |v| format!("jitter {:.3} ms  ", v * 1e3));
    lines.push((
        Tone::Plain,
        format!("{rate}{jitter}samples {}  gaps {}", h.samples, h.gaps),
    ));
    let tone = match is_silent(sensor, now) {
        true => Tone::Silent,
        false => Tone::Plain,
    };
    lines.push((
        tone,
        format!(
            "lost {}  missing {}  dropped {}  {}",
            h.lost,
            h.missing,
            sensor.dropped,
            age(sensor, now)
        ),
    ));
    lines
}

/// Nothing, where nobody knows.
fn rate(sensor: &Sensor) -> String {
    let rate = sensor.health.rate_hz;
    rate.map_or_else(String::new, |v| format!("{v:.1} Hz  "))
}

/// Time since it was heard last, in words.
fn age(sensor: &Sensor, now: Instant) -> String {
    match silence(sensor, now) {
        Some(time) if time > SILENT => format!("silent for {}", lasting(time)),
        Some(time) => format!("last {} ago", lasting(time)),
        None if sensor.attitude.is_some() => ENDED.to_owned(),
        None => NEVER_HEARD.to_owned(),
    }
}

/// Lines of what corrects it, how well tilt and heading are known, and what was learned of the gyro.
fn knowledge(sensor: &Sensor) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(known) = &sensor.health.attitude {
        let by = match &known.aided {
            Some(by) => format!("aided by {}", shortened(&printable(by))),
            None => "NOT aided".to_owned(),
        };
        let rest = if known.rest { ", at rest" } else { "" };
        let sigma = |v: Option<f64>| figure(v.unwrap_or(f64::NAN), 7, 3).replace('+', " ");
        let (tilt, heading) = (sigma(known.sigma_deg.tilt), sigma(known.sigma_deg.heading));
        lines.push(format!(
            "{by}{rest}  sigma of tilt {tilt}  heading {heading}  deg"
        ));
    }
    if let Some((bias, sigma)) = sensor.health.bias() {
        let [x, y, z] = bias.map(|v| figure(v.to_degrees(), 7, 3));
        let most = figure(sigma.into_iter().fold(0.0, f64::max).to_degrees(), 7, 3);
        lines.push(format!(
            "bias x{x}  y{y}  z{z}  deg/s (1 sigma at most {})",
            most.trim_start_matches([' ', '+'])
        ));
    }
    lines
}

/// Lines where there is no terminal: one for each sensor, and one when the daemon is not there.
pub(super) fn plain(board: &Board, now: Instant) -> String {
    let mut out = String::new();
    if let LinkState::Lost(..) | LinkState::Connecting = board.link {
        out.push_str(&heading(board, now).1);
        out.push('\n');
        return out;
    }
    if let Some(what) = &board.complaint {
        out.push_str(&format!("the daemon says {what}\n"));
    }
    for (id, sensor) in &board.sensors {
        let Some(a) = &sensor.attitude else {
            out.push_str(&format!(
                "{}  {NEVER_HEARD}  samples {}\n",
                shortened(id),
                sensor.health.samples
            ));
            continue;
        };
        let known: String = knowledge(sensor).iter().map(|l| format!("{l}  ")).collect();
        let words: String = unusual(a)
            .filter(|word| *word != "last")
            .map(|word| format!("  {word}"))
            .collect();
        let h = &sensor.health;
        out.push_str(&format!(
            "{}  seq {}  {}  {known}{}gaps {}  lost {}  dropped {}  {}{words}\n",
            shortened(id),
            a.seq,
            angles(a),
            rate(sensor),
            h.gaps,
            h.lost,
            sensor.dropped,
            age(sensor, now)
        ));
    }
    out
}

/// A number in so many characters, with its sign; one that does not fit says how large it is, and what nobody knows is
/// a dash.
fn figure(value: f64, width: usize, digits: usize) -> String {
    if value.is_nan() {
        return format!("{:>width$}", "-");
    }
    let text = format!("{value:+width$.digits$}");
    match text.len() > width {
        true => format!("{value:+width$.1e}"),
        false => text,
    }
}

/// A time for people.
fn lasting(time: Duration) -> String {
    match time.as_secs() {
        0..10 => format!("{:.1} s", time.as_secs_f64()),
        s @ 10..120 => format!("{s} s"),
        s @ 120..7200 => format!("{} min", s / 60),
        s => format!("{} h", s / 3600),
    }
}

#[cfg(test)]
mod tests;
