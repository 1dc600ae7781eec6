//! Promise: a living link is recognised by whole frames, loses nothing that was held, and names what does not come.

use super::*;

#[test]
fn a_link_of_which_nobody_says_what_it_is_is_recognised_by_whole_frames() {
    let all = devices().into_iter();
    for (name, bytes) in all {
        let mut link = Link::of(Asked::Auto).unwrap();
        let mut lines = Vec::new();
        let noisy = [b"boot\r\n\xfa\xff\x36\x55\x50", &bytes[5..]].concat();
        noisy
            .chunks(3)
            .for_each(|part| link.push(part, Nanos(0), Some("left"), &mut lines));
        let notes = link.notes();
        assert!(
            notes[0].text.ends_with(&format!("protocol={name}")),
            "{name}: {notes:?}"
        );
        let mut known = Link::of(Asked::Named(named(name))).unwrap();
        let mut wanted = Vec::new();
        known.push(&noisy, Nanos(0), Some("left"), &mut wanted);
        assert_eq!(lines, wanted, "{name}: nothing that was held is lost");
        let text = String::from_utf8(lines).unwrap();
        assert!(text.starts_with("{\"id\":\"left\""), "{text}");
    }
}

#[test]
fn lines_of_text_are_recognised_and_what_is_nothing_is_named_once() {
    let pushed = |parts: &[(&[u8], i64)]| {
        let mut link = Link::of(Asked::Auto).unwrap();
        let mut lines = Vec::new();
        for (bytes, now) in parts {
            link.push(bytes, Nanos(*now), None, &mut lines);
        }
        let notes: Vec<String> = link.notes().into_iter().map(|note| note.text).collect();
        (String::from_utf8_lossy(&lines).into_owned(), notes)
    };
    let (lines, notes) = pushed(&[(b"{\"gyro\":[1,", 0), (b"2,3]}\n", 1)]);
    assert_eq!(lines, "{\"gyro\":[1,2,3]}\n");
    assert_eq!(notes, ["recognised lines of text"]);
    let (lines, _) = pushed(&[(b"ms,gx,gy,gz\n1,2,3,4\n", 0)]);
    assert_eq!(lines, "", "it may be boot text");
    let boot = b"ets Jun  8 2016 00:22:57\nrst:0x1\n".repeat(9);
    let (lines, notes) = pushed(&[(&boot, 0), (&stream("mip", 4), 5_000_000_000)]);
    assert_eq!((lines.lines().count(), notes.len()), (4, 1), "{notes:?}");
    let mut link = Link::of(Asked::Auto).unwrap();
    let mut rest = Vec::new();
    link.push(b"ms,gx,gy,gz\n1,2", Nanos(0), None, &mut rest);
    link.finish(&mut rest);
    assert_eq!(rest, b"ms,gx,gy,gz\n1,2", "nothing more comes");
    let (lines, _) = pushed(&[(b"ms,gx,gy,gz\n1,2,3,4\n", 0), (b"2,2", 2_000_000_000)]);
    assert_eq!(lines, "ms,gx,gy,gz\n1,2,3,4\n2,2");
    // Bytes of another rate.
    let noise: Vec<u8> = (0..3000u32)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8 | 0x80)
        .collect();
    let (lines, notes) = pushed(&[
        (&noise, 0),
        (&noise, 1_000_000_000),
        (&noise, 2_100_000_000),
        (&noise, 3_000_000_000),
    ]);
    assert!(lines.is_empty() && notes.len() == 1, "{notes:?}");
    assert!(
        notes[0].starts_with("9000 bytes and no frame of any known protocol"),
        "{notes:?}"
    );
    // An attitude alone is named, not read.
    let (lines, notes) = pushed(&[(&stream("bno08x-rvc", 5), 0)]);
    assert!(lines.is_empty() && notes[0].contains("cannot be used: its frames hold an attitude"));
}

#[test]
fn a_protocol_that_does_not_come_is_named() {
    let mut link = Link::of(Asked::Named(named("mip"))).unwrap();
    let mut lines = Vec::new();
    link.push(&[0x80; 500], Nanos(0), None, &mut lines);
    assert!(link.notes().is_empty());
    link.push(&[0x80; 500], Nanos(2_000_000_000), None, &mut lines);
    let notes = link.notes();
    assert!(
        notes[0]
            .text
            .starts_with("1000 bytes and no frame of MicroStrain MIP in 2 s"),
        "{notes:?}"
    );
}
