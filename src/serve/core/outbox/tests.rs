//! Tests of what a client gets, what gives way, and what it is told of that.

use super::*;
use crate::serve::core::channel::Channel;
use crate::serve::core::last_attitude::Wanted;
use crate::sink::Stream;
use nalgebra::Vector3;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};

/// A sample with nothing special about it.
fn sample(stamp: Nanos) -> AttitudeSample {
    AttitudeSample {
        stamp,
        q_nb: Quaternion::assume_unit([0.5, -0.5, 0.5, 0.5]),
        rate: BodyRate(Vector3::new(0.1, -0.2, 0.3)),
        accel: None,
        linear_acceleration: None,
        covariance: AttitudeCovariance::from_sigma(Vector3::new(1e-3, 2e-3, 3e-3)),
        status: Status::OK,
        reset_count: 0,
        log: stamp,
        temperature: None,
    }
}

fn chunk(id: &str, first_seq: u64, size: usize) -> Chunk {
    Chunk {
        id: id.into(),
        first_seq,
        count: 10,
        bytes: vec![b'x'; size].into(),
        label: None,
    }
}

fn offer(outbox: &Outbox, chunk: &Chunk) {
    outbox.offer(
        &chunk.id,
        &[],
        &mut |_| vec![chunk.clone()],
        &|_, _| chunk.clone(),
        chunk.first_seq,
    );
}

fn texts(taken: &VecDeque<Bytes>) -> Vec<String> {
    taken
        .iter()
        .map(|b| String::from_utf8_lossy(b).into_owned())
        .collect()
}

#[test]
fn the_oldest_give_way_and_are_counted_by_sensor_before_the_next_data() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter::default()));
    for n in 0..20 {
        offer(
            &outbox,
            &chunk(if n % 2 == 0 { "a" } else { "b" }, n / 2 * 10, 32 << 10),
        );
    }
    // 8 of 32 KiB fit.
    let level = outbox.level();
    assert_eq!((level.queued, level.dropped), (256 << 10, 120));
    let mut out = VecDeque::new();
    let taken = outbox.take(usize::MAX, &mut out);
    assert_eq!(taken, 256 << 10);
    let said: Vec<serde_json::Value> = texts(&out)
        .iter()
        .filter_map(|t| serde_json::from_str(t).ok())
        .collect();
    assert_eq!(said.len(), 2);
    for (gap, id) in said.iter().zip(["a", "b"]) {
        assert_eq!(gap["class"], "GAP");
        assert_eq!(gap["id"], id);
        assert_eq!(gap["dropped"], 60);
        assert_eq!(
            (&gap["first_seq"], &gap["last_seq"]),
            (&0.into(), &59.into())
        );
    }
    // What is being written still counts.
    offer(&outbox, &chunk("a", 100, 1));
    assert_eq!(outbox.level().dropped, 130);
    outbox.written(taken);
    assert_eq!(outbox.level().queued, 0);
}

#[test]
fn a_note_keeps_its_place_among_the_attitudes_and_the_last_one_is_never_dropped() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter::default()));
    offer(&outbox, &chunk("a", 0, 4));
    outbox.note(Bytes::from("one"), false);
    offer(&outbox, &chunk("a", 10, 4));
    outbox.note(Bytes::from("a tick too many"), true);
    let mut out = VecDeque::new();
    let taken = outbox.take(usize::MAX, &mut out);
    assert_eq!(
        (texts(&out), taken),
        (["xxxx", "one", "xxxx"].map(str::to_owned).to_vec(), 11)
    );
    outbox.written(taken);
    // Told again, once nothing of the kind waits.
    outbox.note(Bytes::from("tick"), true);
    outbox.note(Bytes::from("two"), false);
    for n in 0..20 {
        offer(&outbox, &chunk("a", n * 10, 32 << 10));
    }
    out.clear();
    outbox.take(0, &mut out);
    let said = texts(&out);
    assert!(
        said[0] == "two" && said[1].contains("GAP") && said.len() == 2,
        "{said:?}"
    );
    outbox.note(Bytes::from("three"), false);
    outbox.forget();
    assert!(outbox.is_empty());
    assert_eq!(outbox.level().queued, 0);
}

#[test]
fn replies_are_never_dropped_and_one_too_many_closes() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter::default()));
    for _ in 0..100 {
        offer(&outbox, &chunk("a", 0, 32 << 10));
    }
    for n in 0..MAX_CONTROL {
        outbox.reply(Bytes::from(n.to_string()));
        assert_eq!(outbox.full(), None, "{n}");
    }
    let mut out = VecDeque::new();
    outbox.take(0, &mut out);
    assert_eq!(
        texts(&out)[..MAX_CONTROL],
        (0..MAX_CONTROL).map(|n| n.to_string()).collect::<Vec<_>>()[..]
    );
    for _ in 0..=MAX_CONTROL {
        outbox.reply(Bytes::new());
    }
    assert_eq!(outbox.full(), Some(Full::Control));
}

#[test]
fn a_packed_stream_is_named_once_before_it_however_many_there_are_and_whatever_is_dropped() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter::default()));
    let packed = |n: u32, size: usize| Chunk {
        label: Some((n, format!("label {n}").into())),
        ..chunk(&n.to_string(), 0, size)
    };
    // More than replies may wait, and more bytes than attitudes may.
    for n in 0..200 {
        offer(&outbox, &packed(n, 10 << 10));
    }
    assert_eq!(outbox.full(), None);
    outbox.reply(Bytes::from("a reply"));
    outbox.forget();
    assert!(!outbox.is_empty());
    offer(&outbox, &packed(199, 4));
    let mut out = VecDeque::new();
    outbox.take(usize::MAX, &mut out);
    let labels = (0..200).map(|n| format!("label {n}"));
    let expected = ["a reply".to_owned()]
        .into_iter()
        .chain(labels)
        .chain(["xxxx".to_owned()]);
    assert!(texts(&out).into_iter().eq(expected), "{:?}", texts(&out));
    assert!(outbox.is_empty());
    out.clear();
    outbox.watch(Some(Filter::default()));
    offer(&outbox, &packed(7, 4));
    outbox.take(usize::MAX, &mut out);
    assert_eq!(texts(&out), ["xxxx"]);
}

#[test]
fn a_client_gets_the_sensors_and_the_rate_it_asked_for() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter {
        ids: Some(["a".to_owned()].into()),
        rate_hz: Some(10.0),
        ..Filter::default()
    }));
    let samples: Vec<_> = (0..100).map(|k| sample(Nanos(k * 10_000_000))).collect();
    for id in ["a", "b"] {
        outbox.offer(
            &id.into(),
            &samples,
            &mut |_| unreachable!("not all are taken"),
            &|_, kept| {
                let lines: String = kept.iter().map(|(seq, _)| format!("{id}{seq}\n")).collect();
                Chunk {
                    bytes: lines.into(),
                    ..chunk(id, 0, 0)
                }
            },
            0,
        );
    }
    let mut out = VecDeque::new();
    outbox.take(usize::MAX, &mut out);
    let expected: String = (0..10).map(|k| format!("a{}\n", k * 10)).collect();
    assert_eq!(texts(&out), [expected]);
    outbox.watch(None);
    offer(&outbox, &chunk("a", 0, 10));
    assert!(outbox.is_empty());
}

#[test]
fn a_client_that_leaves_its_answers_unread_is_full_long_before_one_is_too_many() {
    let outbox = Outbox::new();
    let mut out = VecDeque::new();
    for _ in 0..MAX_CONTROL / 4 {
        assert!(!outbox.is_full());
        outbox.reply(Bytes::from("x"));
        // Taken is not read.
        outbox.take(0, &mut out);
    }
    assert!(outbox.is_full());
    outbox.written(0);
    assert!(!outbox.is_full());
    outbox.reply(vec![b'x'; 512 << 10].into());
    assert!(outbox.is_full());
}

#[test]
fn the_state_is_owed_once_from_the_question_until_the_answer_has_left() {
    let outbox = Outbox::new();
    let mut out = VecDeque::new();
    assert!(!outbox.owes_answer());
    assert!(outbox.ask() && !outbox.ask());
    // Larger than all replies together may be, and no reason to close.
    outbox.reply(Bytes::from("a reply"));
    outbox.answer(vec![b'x'; 4 << 20].into());
    assert!(!outbox.is_empty() && !outbox.ask());
    outbox.take(0, &mut out);
    assert_eq!((out.len(), outbox.full()), (2, None));
    assert!(outbox.is_empty() && outbox.owes_answer() && !outbox.ask());
    outbox.written(0);
    assert!(!outbox.owes_answer() && outbox.ask());
}

#[test]
fn a_thousand_new_streams_at_once_are_no_fault_of_who_is_told() {
    let outbox = Outbox::new();
    for _ in 0..1000 {
        outbox.announce(vec![b'x'; 3000].into());
    }
    assert_eq!((outbox.full(), outbox.is_full()), (None, false));
    let mut out = VecDeque::new();
    outbox.take(0, &mut out);
    assert_eq!(out.len(), 1000);
    for _ in 0..3000 {
        outbox.announce(vec![b'x'; 3000].into());
    }
    assert_eq!(outbox.full(), Some(Full::Control), "memory is bounded");
}

/// Last attitudes of streams `0..count`, number 7 of each.
fn lasts(count: usize, form: Form) -> Vec<Last> {
    (0..count)
        .map(|n| {
            let mut stream = Stream::new("imu", "imu");
            stream.id = n.to_string();
            let channel = Arc::new(Channel::new(n as u32 + 1, &stream, "imu".to_owned()));
            Last::new(channel, 7, sample(Nanos(1)), Wanted::Object(form))
        })
        .collect()
}

/// Everything, taken in pieces as a socket takes it.
fn drained(outbox: &Outbox) -> Vec<String> {
    let mut out = VecDeque::new();
    while !outbox.is_empty() {
        let taken = outbox.take(1000, &mut out);
        outbox.written(taken);
    }
    texts(&out)
}

#[test]
fn a_last_attitude_comes_before_newer_ones_of_its_stream_and_takes_no_room_from_any() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter::default()));
    // Asked for before: it stays where it is.
    offer(&outbox, &chunk("before", 0, 4));
    let since = outbox.queued_so_far();
    for last in lasts(300, Form::Lines) {
        outbox.offer_last(last, since);
    }
    let level = outbox.level();
    assert_eq!((level.queued, level.dropped), (4, 0));
    // Newer ones of two streams: of one all that came since gives way, of the other nothing.
    for n in 0..9 {
        offer(&outbox, &chunk("5", 8 + n * 10, 32 << 10));
    }
    offer(&outbox, &chunk("299", 8, 1));
    assert_eq!(
        outbox.level().dropped,
        30,
        "the one before, and of stream 5"
    );
    let said = drained(&outbox);
    for (n, line) in said[..300].iter().enumerate() {
        let att: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(
            (&att["id"], &att["seq"]),
            (&n.to_string().into(), &7.into())
        );
        assert_eq!(att["status"], serde_json::json!(["last"]));
    }
    let gaps: Vec<serde_json::Value> = said[300..302]
        .iter()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(
        (&gaps[0]["id"], &gaps[0]["first_seq"]),
        (&"5".into(), &8.into())
    );
    assert_eq!(
        (&gaps[1]["id"], &gaps[1]["dropped"]),
        (&"before".into(), &10.into())
    );
    assert_eq!(said.len(), 300 + 2 + 7 + 1);
    assert_eq!(outbox.level().queued, 0);
}

#[test]
fn a_last_attitude_waits_its_turn_and_is_left_out_where_its_stream_came_meanwhile() {
    let outbox = Outbox::new();
    outbox.watch(Some(Filter::default()));
    offer(&outbox, &chunk("0", 0, 4));
    let since = outbox.queued_so_far();
    offer(&outbox, &chunk("1", 7, 4));
    for last in lasts(3, Form::Packed) {
        outbox.offer_last(last, since);
    }
    // Nobody watches stream 2 any more.
    outbox.watch(Some(Filter {
        ids: Some(["0".to_owned(), "1".to_owned()].into()),
        ..Filter::default()
    }));
    let mut out = VecDeque::new();
    let taken = outbox.take(usize::MAX, &mut out);
    assert_eq!(taken, 4 + 4 + strapd_recording::decode::packed::ATT);
    let [before, meanwhile, label, last] = out.make_contiguous() else {
        unreachable!("{out:?}")
    };
    assert_eq!((&before[..], &meanwhile[..]), (&b"xxxx"[..], &b"xxxx"[..]));
    assert!(label.starts_with(b"{\"class\":\"PACKED\",\"stream\":1,"));
    assert!(strapd_recording::decode::packed::is_packed(last));
    for last in lasts(3, Form::Lines) {
        outbox.offer_last(last, 0);
    }
    outbox.forget();
    assert!(outbox.is_empty());
}
