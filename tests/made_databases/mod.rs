//! Messages -> a recording of ROS 2 in SQLite, written from the format's description alone: leaves in order, one page
//! above them, no index. Python's sqlite3 finds nothing wrong with it (`tests/commands/rosbag2.rs`).
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

/// A topic: its name and type.
pub type Topic<'a> = (&'a str, &'a str);
/// A message: which of the topics, when, and what.
pub type Message<'a> = (usize, u64, &'a [u8]);

/// Kind and bytes of a value.
type Value<'a> = (usize, Vec<u8>);

fn varint(n: usize) -> Vec<u8> {
    let mut bytes = vec![(n & 0x7f) as u8];
    let mut rest = n >> 7;
    while rest > 0 {
        bytes.insert(0, 0x80 | (rest & 0x7f) as u8);
        rest >>= 7;
    }
    bytes
}

fn text(text: &str) -> Value<'_> {
    (13 + 2 * text.len(), text.as_bytes().to_vec())
}

fn number(n: u64) -> Value<'static> {
    (6, n.to_be_bytes().to_vec())
}

/// A row: kinds, then bytes of its values.
fn row(rowid: usize, values: &[Value<'_>]) -> Vec<u8> {
    let kinds: Vec<u8> = values.iter().flat_map(|(kind, _)| varint(*kind)).collect();
    // As long as its own length takes one byte.
    let mut row = varint(kinds.len() + 1);
    row.extend(kinds);
    values.iter().for_each(|(_, bytes)| row.extend(bytes));
    [varint(row.len()), varint(rowid), row].concat()
}

/// A page whose header begins at `head`, which has no room for more cells than it is given.
fn page(kind: u8, size: usize, head: usize, cells: &[Vec<u8>], last: u32) -> Vec<u8> {
    let mut page = vec![0; size];
    let mut end = size;
    page[head] = kind;
    page[head + 3..head + 5].copy_from_slice(&(cells.len() as u16).to_be_bytes());
    let mut at = head + 8;
    if kind == 0x05 {
        page[at..at + 4].copy_from_slice(&last.to_be_bytes());
        at += 4;
    }
    for cell in cells {
        end -= cell.len();
        assert!(at + 2 <= end, "no room");
        page[end..end + cell.len()].copy_from_slice(cell);
        page[at..at + 2].copy_from_slice(&(end as u16).to_be_bytes());
        at += 2;
    }
    page[head + 5..head + 7].copy_from_slice(&(end as u16).to_be_bytes());
    page
}

/// The recording, in pages of `size` bytes, each message in one of them.
pub fn database(size: usize, topics: &[Topic<'_>], messages: &[Message<'_>]) -> Vec<u8> {
    let rows = messages.iter().enumerate().map(|(n, (topic, time, data))| {
        let blob = (12 + 2 * data.len(), data.to_vec());
        row(
            n + 1,
            &[
                (0, Vec::new()),
                number(*topic as u64 + 1),
                number(*time),
                blob,
            ],
        )
    });
    let mut leaves: Vec<(usize, Vec<Vec<u8>>)> = vec![(0, Vec::new())];
    let mut room = size - 8;
    for (n, row) in rows.enumerate() {
        if row.len() + 2 > room {
            leaves.push((0, Vec::new()));
            room = size - 8;
        }
        room -= row.len() + 2;
        let (last, rows) = leaves.last_mut().unwrap();
        *last = n + 1;
        rows.push(row);
    }
    let above: Vec<Vec<u8>> = leaves[..leaves.len() - 1]
        .iter()
        .enumerate()
        .map(|(n, (last, _))| [(4 + n as u32).to_be_bytes().to_vec(), varint(*last)].concat())
        .collect();
    let table = |rowid, name: &str, root: u64, sql: &str| {
        let values = [
            text("table"),
            text(name),
            text(name),
            number(root),
            text(sql),
        ];
        row(rowid, &values)
    };
    let tables = [
        table(
            1,
            "topics",
            2,
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)",
        ),
        table(
            2,
            "messages",
            3,
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)",
        ),
    ];
    let mut first = page(0x0d, size, 100, &tables, 0);
    first[..16].copy_from_slice(b"SQLite format 3\0");
    let said = if size == 65_536 { 1 } else { size as u16 };
    first[16..18].copy_from_slice(&said.to_be_bytes());
    // Versions of the format for writing and reading, and the fractions that are always these.
    first[18..24].copy_from_slice(&[1, 1, 0, 64, 32, 32]);
    // Tables as of version 4, texts in UTF-8.
    (first[47], first[59]) = (4, 1);
    let topics: Vec<Vec<u8>> = topics
        .iter()
        .enumerate()
        .map(|(n, (name, kind))| {
            row(
                n + 1,
                &[(0, Vec::new()), text(name), text(kind), text("cdr")],
            )
        })
        .collect();
    let mut bytes = first;
    bytes.extend(page(0x0d, size, 0, &topics, 0));
    let last = 3 + leaves.len() as u32;
    bytes.extend(page(0x05, size, 0, &above, last));
    for (_, rows) in &leaves {
        bytes.extend(page(0x0d, size, 0, rows, 0));
    }
    let pages = (bytes.len() / size) as u32;
    bytes[28..32].copy_from_slice(&pages.to_be_bytes());
    bytes
}

/// Makes the checksums of a file `-wal` right again.
pub fn sealed(wal: &mut [u8]) {
    fn sums(mut sums: (u32, u32), bytes: &[u8], is_big: bool) -> (u32, u32) {
        let number = |bytes: &[u8]| {
            let bytes = bytes.try_into().unwrap();
            match is_big {
                true => u32::from_be_bytes(bytes),
                false => u32::from_le_bytes(bytes),
            }
        };
        for pair in bytes.chunks_exact(8) {
            sums.0 = sums.0.wrapping_add(number(&pair[..4])).wrapping_add(sums.1);
            sums.1 = sums.1.wrapping_add(number(&pair[4..])).wrapping_add(sums.0);
        }
        sums
    }
    if wal.len() < 32 {
        return;
    }
    let is_big = wal[3] & 1 == 1;
    let size = u32::from_be_bytes(wal[8..12].try_into().unwrap()) as usize;
    let mut known = sums((0, 0), &wal[..24], is_big);
    wal[24..28].copy_from_slice(&known.0.to_be_bytes());
    wal[28..32].copy_from_slice(&known.1.to_be_bytes());
    for frame in wal[32..].chunks_exact_mut(24_usize.saturating_add(size).max(24)) {
        known = sums(known, &frame[..8], is_big);
        known = sums(known, &frame[24..], is_big);
        frame[16..20].copy_from_slice(&known.0.to_be_bytes());
        frame[20..24].copy_from_slice(&known.1.to_be_bytes());
    }
}
