//! ROS 2 in SQLite: pages, their cells and the file beside them, whose checksums are right.

use super::{Changed, fixture, rearrange, renumber_big};
use crate::made_databases::{database, sealed};
use crate::made_logs::{logged, motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Bytes of a page of the recordings that are changed.
const PAGE: usize = 1024;
const WAL_HEAD: usize = 32;
const FRAME: usize = 24;

/// A number that a page of a table holds: of its head, of a place, or of a cell.
fn change_page(page: &mut [u8], head: usize, rng: &mut ChaCha8Rng) {
    let pointers = head + if page.get(head) == Some(&5) { 12 } else { 8 };
    let cells = page.get(head + 3..head + 5);
    let cells = cells.map_or(0, |bytes| {
        usize::from(bytes[0]) << 8 | usize::from(bytes[1])
    });
    let nth = rng.random_range(0..cells.clamp(1, 500));
    let place = page.get(pointers + 2 * nth..pointers + 2 * nth + 2);
    let place = place.map_or(0, |bytes| {
        usize::from(bytes[0]) << 8 | usize::from(bytes[1])
    });
    match rng.random_range(0..8) {
        0 => page[head] = [2, 5, 10, 13][rng.random_range(0..4)],
        1 => renumber_big(page, head + 3, 2, rng),
        2 => renumber_big(page, pointers + 2 * nth, 2, rng),
        3 => renumber_big(page, head + 8, 4, rng),
        4 => renumber_big(page, place, 4, rng),
        // Lengths and kinds of values, one or two bytes each.
        5 | 6 => renumber_big(page, place + rng.random_range(0..10), 1, rng),
        _ => {
            let at = place + rng.random_range(0..12);
            let end = (at + rng.random_range(1..9)).min(page.len());
            if let Some(varint) = page.get_mut(at..end) {
                varint.fill(0xff);
            }
        }
    }
}

fn change(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let count = bytes.len() / PAGE;
    if rng.random_range(0..4) == 0 {
        // Sizes, versions, how many pages there are, and which are free.
        let (at, width) = [
            (16, 2),
            (20, 1),
            (24, 4),
            (28, 4),
            (32, 4),
            (36, 4),
            (56, 4),
            (92, 4),
        ][rng.random_range(0..8)];
        return renumber_big(bytes, at, width, rng);
    }
    if rng.random_range(0..6) == 0 {
        let mut pages: Vec<Vec<u8>> = bytes.chunks(PAGE).map(<[u8]>::to_vec).collect();
        let first = pages.remove(0);
        rearrange(&mut pages, rng);
        *bytes = [first, pages.concat()].concat();
        return;
    }
    let page = rng.random_range(0..count);
    let head = if page == 0 { 100 } else { 0 };
    change_page(&mut bytes[page * PAGE..(page + 1) * PAGE], head, rng);
}

fn change_wal(wal: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let size = FRAME + PAGE;
    let count = (wal.len() - WAL_HEAD) / size;
    let at = WAL_HEAD + rng.random_range(0..count.max(1)) * size;
    match rng.random_range(0..8) {
        0 => {
            let mut frames: Vec<Vec<u8>> =
                wal[WAL_HEAD..].chunks(size).map(<[u8]>::to_vec).collect();
            rearrange(&mut frames, rng);
            wal.truncate(WAL_HEAD);
            wal.extend(frames.concat());
        }
        1 => renumber_big(wal, at + 8, 4, rng),
        2 | 3 => renumber_big(wal, at, 4, rng),
        4 | 5 => renumber_big(wal, at + 4, 4, rng),
        _ => {
            if let Some(page) = wal.get_mut(at + FRAME..at + size) {
                change_page(page, 0, rng);
            }
        }
    }
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let imu = logged("/imu", &motion(40));
    let packed = zstd::bulk::compress(&imu[0].payload, 1).unwrap();
    let mut rows: Vec<_> = imu
        .iter()
        .map(|m| (0, m.log_time, m.payload.as_slice()))
        .collect();
    rows.push((1, imu[0].log_time, &packed));
    let topics = [("/imu", "sensor_msgs/msg/Imu"), ("/other", "a/msg/B")];
    let made = database(1024, &topics, &rows);
    let killed = fixture("constant_rate_killed.db3");
    let beside = fixture("constant_rate_killed.db3-wal");
    Box::new(move |rng| {
        if rng.random() {
            let mut bytes = made.clone();
            for _ in 0..rng.random_range(1..5) {
                change(&mut bytes, rng);
            }
            return bytes.into();
        }
        let (mut bytes, mut wal) = (killed.clone(), beside.clone());
        for _ in 0..rng.random_range(1..5) {
            match rng.random_range(0..4) {
                0 => change(&mut bytes, rng),
                _ => change_wal(&mut wal, rng),
            }
        }
        sealed(&mut wal);
        Changed {
            bytes,
            wal: Some(wal),
        }
    })
}
