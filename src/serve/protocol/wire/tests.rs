//! Tests of what a line asks for, and of the lines that answer.

use super::*;
use serde_json::Value;
use strapd_recording::text::snippet;

fn ask(text: &str) -> Result<Message, Fault> {
    let mut samples = Vec::new();
    let read = read(
        &LineDecoder::default(),
        text.as_bytes(),
        Nanos(7),
        &mut samples,
    );
    let is_sample = matches!(read, Ok(Message::Samples(_)));
    assert_eq!(is_sample, !samples.is_empty(), "{text}: {samples:?}");
    read
}

#[test]
fn a_line_is_a_sample_or_a_request_or_a_fault() {
    for text in [
        r#"{"class":"RATE","gyro":[1,2,3],"stamp":{"sec":1,"nsec":0}}"#,
        r#"{"class":"RATE","gyro":null}"#,
        r#"{"gyro":[1,2,3]}"#,
        r#"{"class":"IMU","gyro_x":1,"gyro_y":2,"gyro_z":3}"#,
    ] {
        assert!(matches!(ask(text), Ok(Message::Samples(_))), "{text}");
    }
    assert_eq!(ask(r#"{"class":"POLL"}"#), Ok(Message::Poll));
    assert_eq!(
        ask(r#"{"class":"AUTH","token":"x"}"#),
        Ok(Message::Auth("x".to_owned()))
    );
    for (text, code) in [
        (
            r#"{"class":"ATT","rate":[1,2,3],"q":{"w":1,"x":0,"y":0,"z":0}}"#,
            "unknown_class",
        ),
        (r#"{"class":"EXEC"}"#, "unknown_class"),
        (r#"{"a":1}"#, "no_rate"),
        (r#"{"class":"AUTH"}"#, "bad_auth"),
        (r#"{"class":"PLAYBACK"}"#, "bad_playback"),
        (r#"{"class":"PLAYBACK","action":"stop"}"#, "bad_playback"),
        (r#"{"class":"PLAYBACK","action":"seek"}"#, "bad_playback"),
        (
            r#"{"class":"PLAYBACK","action":"seek","at":1}"#,
            "bad_playback",
        ),
        (
            r#"{"class":"PLAYBACK","action":"speed","speed":"2"}"#,
            "bad_playback",
        ),
        (r#"{"class":"WATCH","streams":["POSE"]}"#, "bad_watch"),
        (r#"{"class":"WATCH","rate_hz":0}"#, "bad_watch"),
        (r#"{"class":"WATCH","rate_hz":"fast"}"#, "bad_watch"),
        (&watching_ids(5000), "bad_watch"),
        (&watching_ids(MAX_WATCHED + 1), "bad_watch"),
        ("nonsense", "bad_json"),
    ] {
        assert_eq!(ask(text).unwrap_err().code, code, "{text}");
    }
}

fn watching_ids(n: usize) -> String {
    let ids: Vec<String> = (0..n).map(|n| format!("\"{n}\"")).collect();
    format!(r#"{{"class":"WATCH","ids":[{}]}}"#, ids.join(","))
}

#[test]
fn who_begins_with_no_object_hears_what_it_speaks_and_where_samples_go_by_http() {
    for (begins, what) in [
        ("POST / HTTP/1.1\r\n", "this is HTTP"),
        ("OPTIONS * HTTP/1.1", "this is HTTP"),
        ("\x16\x03\x01\x02", "this is TLS"),
        ("[{\"gyro\":[1,2,3]}]", "an array"),
        ("GET", "no JSON object"),
        (" ", "no JSON object"),
        ("", "no JSON object"),
    ] {
        let fault = no_object(begins.as_bytes(), true);
        assert!(fault.message.contains(what), "{begins}: {fault:?}");
        assert!(fault.message.contains("POST /samples"), "{fault:?}");
        let of_replay = no_object(begins.as_bytes(), false);
        assert!(!of_replay.message.contains("samples"), "{of_replay:?}");
    }
}

#[test]
fn playback_is_asked_for_by_name() {
    for (text, action) in [
        (r#""action":"play""#, Action::Play),
        (r#""action":"pause","x":1"#, Action::Pause),
        (
            r#""action":"seek","at":{"sec":-1,"nsec":999999999}"#,
            Action::Seek(Nanos(-1)),
        ),
        (r#""action":"speed","speed":2"#, Action::Speed(2.0)),
    ] {
        let text = format!("{{\"class\":\"PLAYBACK\",{text}}}");
        assert_eq!(ask(&text), Ok(Message::Playback(action)), "{text}");
    }
}

#[test]
fn watch_names_sensors_and_rate_and_can_be_ended() {
    let filter = |text: &str| match ask(text) {
        Ok(Message::Watch(filter)) => filter,
        other => unreachable!("{other:?}"),
    };
    let all = Filter {
        last: true,
        ..Filter::default()
    };
    assert_eq!(filter(r#"{"class":"WATCH"}"#), Some(all.clone()));
    assert_eq!(
        filter(r#"{"class":"WATCH","last":false}"#),
        Some(Filter::default())
    );
    assert_eq!(filter(r#"{"class":"WATCH","enable":false}"#), None);
    assert_eq!(filter(r#"{"class":"WATCH","streams":[]}"#), None);
    let most = filter(&watching_ids(MAX_WATCHED)).and_then(|f| f.ids);
    assert_eq!(most.map(|ids| ids.len()), Some(MAX_WATCHED));
    assert_eq!(
        filter(r#"{"class":"WATCH","id":"a","rate_hz":50,"from":"now","x":[]}"#),
        Some(Filter {
            ids: Some(["a".to_owned()].into()),
            rate_hz: Some(50.0),
            ..all
        })
    );
}

#[test]
fn packed_is_asked_for_and_the_answer_repeats_it_and_only_then() {
    for (asked, form) in [("true", Form::Packed), ("false", Form::Lines)] {
        let text = format!("{{\"class\":\"WATCH\",\"packed\":{asked}}}");
        let Ok(Message::Watch(Some(filter))) = ask(&text) else {
            unreachable!("{text}");
        };
        assert_eq!(filter.form, form);
        let answer: Value =
            serde_json::from_slice(&watching(Some(&filter), &[Stream::Att])).unwrap();
        let is_packed = form == Form::Packed;
        assert_eq!(
            answer.get("packed"),
            is_packed.then_some(&Value::Bool(true))
        );
    }
    assert_eq!(
        ask(r#"{"class":"WATCH","packed":1}"#).unwrap_err().code,
        "bad_watch"
    );
}

#[test]
fn a_fault_names_its_line_and_column_and_repeats_little_of_it() {
    let bad = b"{\"class\":\"RATE\" \"gyro\":1}\x1b[31m";
    let mut none = Vec::new();
    let fault = read(&LineDecoder::default(), bad, Nanos(0), &mut none).unwrap_err();
    let said: Value = serde_json::from_slice(&error(&fault, 42, bad, 3)).unwrap();
    assert_eq!(said["class"], "ERROR");
    assert_eq!(said["code"], "bad_json");
    assert_eq!(said["line"], 42);
    assert_eq!(said["column"], 17);
    assert_eq!(said["suppressed"], 3);
    assert!(!said["near"].as_str().unwrap().contains('\x1b'));
    for hostile in [
        vec![0x1b; 70_000],
        vec![0xff; 100],
        "é\u{202e}".repeat(99).into_bytes(),
    ] {
        assert!(snippet(&hostile).len() <= strapd_recording::text::MAX_NEAR);
    }
}
