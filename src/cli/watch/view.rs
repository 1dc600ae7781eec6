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
/// Silence after which a sensor is marked.
const SILENT: Duration = Duration::from_secs(2);
/// Silence after which it stands behind those that speak, in one line.
const FOLDED: Duration = Duration::from_secs(5);
/// Text for a sensor that has said nothing to us, but what was last before we came.
const NEVER_HEARD: &str = "silent since this watch began";
/// Longest name that is shown whole.
const MAX_NAME: usize = 48;

/// Tone of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Heading,
    Alarm,
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
    let is_silent = |sensor: &&Sensor| silence(sensor, now).is_none_or(|time| time > FOLDED);
    let silent = match board.sensors.values().filter(is_silent).count() {
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
    let is_silent = |sensor: &Sensor| silence(sensor, now).is_none_or(|time| time > FOLDED);
    let all_are = board.sensors.values().all(is_silent);
    // Of one without an attitude there is nothing to unfold.
    let (folded, shown): (Vec<_>, Vec<_>) = board
        .sensors
        .iter()
        .partition(|(_, sensor)| is_silent(sensor) && (!all_are || sensor.attitude.is_none()));
    for (id, sensor) in shown {
        let alarm = alarm(sensor, now);
        let tone = if alarm { Tone::Alarm } else { Tone::Heading };
        lines.push((tone, title(id, sensor)));
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
        let said = match (silence(sensor, now), &sensor.attitude) {
            (Some(time), _) => format!("{}  silent for {}", shortened(id), lasting(time)),
            (None, Some(_)) => title(id, sensor),
            (None, None) => format!("{}  {NEVER_HEARD}", shortened(id)),
        };
        let angles = sensor.attitude.as_ref().map(|a| format!("  {}", angles(a)));
        lines.push((Tone::Alarm, said + &angles.unwrap_or_default()));
    }
    lines
}

/// Time since it was heard; `None`: it never was.
fn silence(sensor: &Sensor, now: Instant) -> Option<Duration> {
    let heard = sensor.heard?;
    Some(now.saturating_duration_since(heard))
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

/// Whether something is wrong with a sensor now.
fn alarm(sensor: &Sensor, now: Instant) -> bool {
    let silent = sensor
        .heard
        .is_none_or(|heard| now.saturating_duration_since(heard) > SILENT);
    let usual = |s: &String| matches!(s.as_str(), "ok" | "provisional" | "aided" | "rest");
    silent
        || sensor
            .attitude
            .as_ref()
            .is_some_and(|a| !a.status.iter().all(usual))
}

fn title(id: &str, sensor: &Sensor) -> String {
    let name = shortened(id);
    match &sensor.attitude {
        Some(a) => {
            let silent = match sensor.heard {
                Some(_) => String::new(),
                None => format!("  {NEVER_HEARD}"),
            };
            let status = a.status.join(" ");
            format!("{name}  {} in {}  {status}{silent}", a.body, a.world)
        }
        None => format!("{name}  {NEVER_HEARD}"),
    }
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
    lines.push((
        Tone::Plain,
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
    sensor.heard.map_or_else(
        || NEVER_HEARD.to_owned(),
        |heard| format!("last {} ago", lasting(now.saturating_duration_since(heard))),
    )
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
        let h = &sensor.health;
        out.push_str(&format!(
            "{}  seq {}  {}  {known}{}gaps {}  lost {}  dropped {}  {}  {}\n",
            shortened(id),
            a.seq,
            angles(a),
            rate(sensor),
            h.gaps,
            h.lost,
            sensor.dropped,
            age(sensor, now),
            a.status.join(",")
        ));
    }
    out
}

/// A number in so many characters, with its sign; one that does not fit says how large it is.
fn figure(value: f64, width: usize, digits: usize) -> String {
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
mod tests {
    use super::*;
    use crate::client::watcher::Said;

    const ATT: &str = r#"{"class":"ATT","id":"imu\u001b[31m0","seq":17,"stamp":{"sec":1700000000,"nsec":5000000},"q":{"w":0.7071067811865476,"x":0.7071067811865476,"y":0.0,"z":0.0},"rotates":"sensor_to_world","world":"start","body":"flu","rate":[0.017453292519943295,0.0,-1e300],"sigma_deg":[0.01,0.01,null],"status":["provisional"],"reset":0}"#;
    const STATUS: &str = r#"{"class":"STATUS","sources":[{"id":"imu\u001b[31m0","samples":18,"lost":1,"missing":2,"gaps":3,"rate_hz":1000.0,"jitter_s":0.00025},{"id":"other","rate_hz":null}]}"#;

    fn board() -> (Board, Instant) {
        board_of(&["imu\u{1b}[31m0".to_owned()])
    }

    fn board_of(ids: &[String]) -> (Board, Instant) {
        let now = Instant::now();
        let mut board = Board::new("tcp://127.0.0.1:4550".to_owned(), ids);
        board.connected(now);
        board.take(Said::Attitude(ATT.as_bytes()), now);
        board.take(Said::Status(STATUS.as_bytes()), now);
        board.take(
            Said::Gap {
                id: "imu\\u{1b}[31m0".to_owned(),
                dropped: 4,
            },
            now,
        );
        (board, now)
    }

    #[test]
    fn every_figure_of_a_sensor_is_shown_and_no_name_commands_the_terminal() {
        let (board, now) = board();
        assert_eq!(board.sensors.len(), 1, "only what is watched");
        for width in [60, 100] {
            let lines = body(&board, now + Duration::from_millis(300), width);
            let text: String = lines.iter().map(|(_, l)| format!("{l}\n")).collect();
            for part in [
                "imu\\u{1b}[31m0  flu in start  provisional",
                "roll   +90.000  pitch    +0.000  yaw    +0.000  deg",
                "w +0.707107  x +0.707107  y +0.000000  z +0.000000",
                "rate x   +1.000  y   +0.000  z",
                "1000.0 Hz  jitter 0.250 ms  samples 18  gaps 3",
                "lost 1  missing 2  dropped 4  last 0.3 s ago",
            ] {
                assert!(text.contains(part), "no `{part}` in\n{text}");
            }
            assert!(!text.contains('\u{1b}'));
            assert_eq!(text.contains("|::"), width == 100, "{text}");
        }
    }

    #[test]
    fn a_sensor_that_has_been_silent_since_the_start_is_shown_all_the_same() {
        let (board, now) = board_of(&[]);
        let lines = body(&board, now, 100);
        let silent = (
            Tone::Alarm,
            "other  silent since this watch began".to_owned(),
        );
        assert_eq!(lines.last(), Some(&silent), "behind those that speak");
        assert!(plain(&board, now).contains("\nother  silent since this watch began  samples 0\n"));
        // Samples of a simulation are no sensor's.
        let (mut board, now) = board_of(&[]);
        let status = r#"{"class":"STATUS","sources":[{"id":"rates","class":"RATE"},{"id":"truth","class":"ATT"}]}"#;
        board.take(Said::Status(status.as_bytes()), now);
        assert!(board.sensors.contains_key("truth") && !board.sensors.contains_key("rates"));
    }

    #[test]
    fn the_last_attitude_of_before_is_shown_as_such_until_another_comes() {
        let now = Instant::now();
        let mut board = Board::new("tcp://127.0.0.1:4550".to_owned(), &[]);
        let last = ATT.replace("\"provisional\"", "\"provisional\",\"last\"");
        board.take(Said::Attitude(last.as_bytes()), now);
        let (tone, text) = body(&board, now, 100)[0].clone();
        assert_eq!(tone, Tone::Alarm);
        assert!(
            text.ends_with("flu in start  provisional last  silent since this watch began"),
            "{text}"
        );
        board.connected(now);
        let text = plain(&board, now);
        assert!(
            text.contains("roll   +90.000")
                && text.ends_with("silent since this watch began  provisional,last\n"),
            "{text}"
        );
        board.take(Said::Attitude(ATT.as_bytes()), now);
        let (tone, text) = body(&board, now, 100)[0].clone();
        assert!(
            tone == Tone::Heading && text.ends_with("  provisional"),
            "{text}"
        );
    }

    #[test]
    fn the_silent_stand_behind_those_that_speak_in_a_line_each() {
        let (mut board, now) = board_of(&[]);
        let of = |id: &str, at: Instant, board: &mut Board| {
            let line = ATT.replace("imu\\u001b[31m0", id);
            board.take(Said::Attitude(line.as_bytes()), at);
        };
        of("a", now, &mut board);
        let later = now + Duration::from_secs(12);
        of("z", later, &mut board);
        for width in [60, 100] {
            let lines = body(&board, later, width);
            assert!(heading(&board, later).1.contains("  4 sensors, 3 silent  "));
            assert_eq!(lines[0].1, "z  flu in start  provisional");
            let folded: Vec<&str> = lines[lines.len() - 3..]
                .iter()
                .map(|(tone, text)| {
                    assert_eq!(*tone, Tone::Alarm);
                    text.as_str()
                })
                .collect();
            let angles = "roll   +90.000  pitch    +0.000  yaw    +0.000  deg";
            assert_eq!(folded[0], format!("a  silent for 12 s  {angles}"));
            assert!(folded[1].starts_with("imu"), "{folded:?}");
            assert_eq!(folded[2], "other  silent since this watch began");
            assert!(lines.iter().all(|(_, text)| !text.contains('?')));
        }
        // Where nobody speaks, what was last is worth the room.
        let lines = body(&board, later + Duration::from_secs(30), 100);
        assert!(lines.len() > 20 && lines[0].1.starts_with("a  flu"));
    }

    #[test]
    fn x_y_and_z_have_the_places_of_their_colours() {
        let (board, now) = board();
        for width in [60, 100] {
            let lines = body(&board, now, width);
            let (tone, text) = lines
                .iter()
                .find(|(_, text)| text.contains("rate x"))
                .unwrap_or_else(|| unreachable!("{lines:?}"));
            let Tone::Axes([x, y, z, end]) = tone else {
                unreachable!("{tone:?}")
            };
            assert_eq!(text[*x..*y].trim(), "x   +1.000");
            assert_eq!(text[*y..*z].trim(), "y   +0.000");
            assert!(text[*z..*end].trim().starts_with('z'), "{text}");
        }
    }

    #[test]
    fn an_aided_attitude_is_no_alarm_and_says_what_is_known() {
        let now = Instant::now();
        let mut board = Board::new("tcp://127.0.0.1:4550".to_owned(), &[]);
        board.connected(now);
        let aided = ATT.replace("\"provisional\"", "\"provisional\",\"aided\",\"rest\"");
        board.take(Said::Attitude(aided.as_bytes()), now);
        let status = r#"{"class":"STATUS","sources":[{"id":"imu\u001b[31m0","attitude":{"aided":"gra\u001b[31mvity","rest":true,"sigma_deg":{"tilt":0.3125,"tilt_least":null,"heading":1.25},"field":null},"aid":{"learned":{"gyro_bias_rad_s":[0.008726646259971648,-0.01,null]},"sigma":{"gyro_bias_rad_s":[1e-4,2e-4,1e-4]}}}]}"#;
        board.take(Said::Status(status.as_bytes()), now);
        let lines = body(&board, now, 100);
        assert_eq!(lines[0].0, Tone::Heading, "{lines:?}");
        let text: String = lines.iter().map(|(_, l)| format!("{l}\n")).collect();
        for text in [text, plain(&board, now)] {
            for part in [
                "aided by gra\\u{1b}[31mvity, at rest  sigma of tilt   0.312  heading   1.250  deg",
                "bias x +0.500  y -0.573  z",
                "deg/s (1 sigma at most 0.011)",
                "provisional",
            ] {
                assert!(text.contains(part), "no `{part}` in\n{text}");
            }
            assert!(!text.contains('\u{1b}'));
        }
        let levelled = aided.replace("\"rest\"", "\"levelled\"");
        board.take(Said::Attitude(levelled.as_bytes()), now);
        assert_eq!(
            body(&board, now, 100)[0].0,
            Tone::Alarm,
            "that is worth a look"
        );
    }

    #[test]
    fn silence_and_loss_are_alarms() {
        let (mut board, now) = board();
        assert_eq!(body(&board, now, 100)[0].0, Tone::Heading);
        assert_eq!(body(&board, now + SILENT * 2, 100)[0].0, Tone::Alarm);
        assert_eq!(heading(&board, now).0, Tone::Heading);
        board.lost("refused".to_owned(), now);
        board.lost("refused again".to_owned(), now + Duration::from_secs(3));
        let (tone, text) = heading(&board, now + Duration::from_secs(4));
        assert_eq!(tone, Tone::Alarm);
        assert!(
            text.contains("NOT CONNECTED for 4.0 s, trying again: refused again"),
            "{text}"
        );
    }
}
