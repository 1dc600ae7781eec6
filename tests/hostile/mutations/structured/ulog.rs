//! ULog: messages whose sizes are right, of other kinds, numbers and layouts.

use super::{Changed, fixture, number, rearrange, renumber, scribble};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const HEAD: usize = 16;

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let whole = fixture("px4_flight.ulg");
    let head = whole[..HEAD].to_vec();
    let mut rest = &whole[HEAD..];
    let mut messages: Vec<(u8, Vec<u8>)> = Vec::new();
    let mut data = 0;
    while let Some((&[a, b, kind], behind)) = rest.split_first_chunk() {
        let Some((body, behind)) = behind.split_at_checked(usize::from(u16::from_le_bytes([a, b])))
        else {
            break;
        };
        rest = behind;
        data += usize::from(kind == b'D');
        messages.push((kind, body.to_vec()));
        // Definitions, and some of the data behind them.
        if data == 200 {
            break;
        }
    }
    Box::new(move |rng| {
        let (mut head, mut messages) = (head.clone(), messages.clone());
        for _ in 0..rng.random_range(1..6) {
            if messages.is_empty() {
                break;
            }
            // What defines something is rare, and what most depends on.
            let defines = |(kind, _): &(u8, Vec<u8>)| b"FAIMPQB".contains(kind);
            let at = match rng.random() {
                true => rng.random_range(0..messages.len()),
                false => messages
                    .iter()
                    .rposition(defines)
                    .map_or(0, |last| rng.random_range(0..last + 1)),
            };
            let (kind, body) = &mut messages[at];
            match rng.random_range(0..9) {
                0 => rearrange(&mut messages, rng),
                1 => *kind = b"FAIMPQDLCSORB"[rng.random_range(0..13)],
                2 | 3 => scribble(body, rng),
                4 => renumber(body, 0, 2, rng),
                5 => renumber(body, 2, 8, rng),
                6 if *kind == b'F' => {
                    // A type or a name in the text of a layout.
                    let text = String::from_utf8_lossy(body).into_owned();
                    let words = [
                        "float[3] ",
                        "double ",
                        "uint64_t ",
                        "uint8_t[65535] ",
                        "a b;",
                        "sensor_gyro x;",
                    ];
                    let word = words[rng.random_range(0..words.len())];
                    let from = ["float ", "uint32_t ", "uint64_t ", ";"][rng.random_range(0..4)];
                    *body = text
                        .replacen(from, word, 1 + rng.random_range(0..3))
                        .into_bytes();
                }
                7 => renumber(&mut head, 8, 8, rng),
                _ => *kind = number(u64::from(*kind), rng) as u8,
            }
        }
        let mut out = head;
        for (kind, mut body) in messages {
            body.truncate(usize::from(u16::MAX));
            out.extend((body.len() as u16).to_le_bytes());
            out.push(kind);
            out.extend(body);
        }
        out.into()
    })
}
