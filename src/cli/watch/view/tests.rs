//! Tests of the picture: every figure, what is an alarm, and what no name can do.

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
            "imu\\u{1b}[31m0  flu in start\n",
            "sigma     0.010       0.010           -  deg (1 sigma, x y z)",
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
        Tone::Silent,
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
    assert_eq!(tone, Tone::Silent);
    assert!(
        text.ends_with("flu in start  ended, silent since this watch began"),
        "{text}"
    );
    board.connected(now);
    let text = plain(&board, now);
    assert!(
        text.contains("roll   +90.000")
            && text.ends_with("  ended, silent since this watch began\n"),
        "{text}"
    );
    board.take(Said::Attitude(ATT.as_bytes()), now);
    let (tone, text) = body(&board, now, 100)[0].clone();
    assert!(
        tone == Tone::Heading && text.ends_with("  flu in start"),
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
        assert_eq!(lines[0].1, "z  flu in start");
        let folded: Vec<&str> = lines[lines.len() - 3..]
            .iter()
            .map(|(tone, text)| {
                assert_eq!(*tone, Tone::Silent);
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
    assert_eq!(
        lines[0],
        (Tone::Silent, "a  flu in start  silent for 42 s".to_owned())
    );
    let found = lines.iter().find(|(_, text)| text.contains("lost "));
    let Some((tone, text)) = found else {
        unreachable!("{lines:?}")
    };
    assert!(
        *tone == Tone::Silent && text.ends_with("silent for 42 s"),
        "{text}"
    );
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
        ] {
            assert!(text.contains(part), "no `{part}` in\n{text}");
        }
        assert!(!text.contains('\u{1b}'));
        assert!(
            !text.contains("provisional") && !text.contains("NaN"),
            "{text}"
        );
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
fn silence_has_a_tone_of_its_own_and_loss_is_an_alarm() {
    let (mut board, now) = board();
    assert_eq!(body(&board, now, 100)[0].0, Tone::Heading);
    assert_eq!(body(&board, now + SILENT * 2, 100)[0].0, Tone::Silent);
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
