#![allow(clippy::unwrap_used, clippy::expect_used)]

use super::*;
use proptest::prelude::*;

/// An item that knows where it was written.
type Item = (u64, usize);

fn batch(times: &[u64], from: usize) -> Batch<Item> {
    let mut batch = Batch::default();
    for (i, time) in times.iter().enumerate() {
        batch.items.push((*time, from + i));
        batch.stamp(*time, 0);
    }
    batch.sort();
    batch
}

/// Items that come out, and how many of them late, when these blocks go in.
fn run(blocks: &[Vec<u64>], lookahead: Lookahead) -> (Vec<Item>, u64) {
    let mut merger = Merger::new(lookahead);
    let (mut out, mut from) = (Vec::new(), 0);
    for times in blocks {
        merger.push(batch(times, from), 100);
        from += times.len();
        while let Some(batch) = merger.pop(false, &mut Batch::default) {
            out.extend(batch.items);
        }
    }
    while let Some(batch) = merger.pop(true, &mut Batch::default) {
        out.extend(batch.items);
    }
    (out, merger.late())
}

fn lookahead(blocks: usize, held_items: usize) -> Lookahead {
    let held_bytes = held_items * (size_of::<Item>() + 8);
    Lookahead {
        blocks,
        bytes: usize::MAX,
        held_bytes,
        item_bytes: usize::MAX,
    }
}

fn in_file_order(blocks: &[Vec<u64>]) -> Vec<Item> {
    blocks
        .iter()
        .flatten()
        .copied()
        .enumerate()
        .map(|(i, t)| (t, i))
        .collect()
}

#[test]
fn equal_times_keep_the_order_of_the_file() {
    let blocks = [vec![5, 5, 9], vec![5, 9, 9], vec![9, 10]];
    let (out, late) = run(&blocks, lookahead(8, 100));
    let places: Vec<_> = out.iter().map(|(_, i)| *i).collect();
    assert_eq!(places, [0, 1, 3, 2, 4, 5, 6, 7]);
    assert_eq!(late, 0);
}

#[test]
fn a_block_that_begins_after_the_last_ended_is_let_go_with_its_own_memory() {
    let mut merger = Merger::new(lookahead(1, 100));
    let first = batch(&[1, 2, 3], 0);
    let memory = first.items.as_ptr();
    merger.push(first, 1);
    assert!(merger.pop(false, &mut Batch::default).is_none());
    merger.push(batch(&[3, 4], 3), 1);
    let out = merger
        .pop(false, &mut || panic!("nothing is copied"))
        .unwrap();
    assert_eq!(out.items.as_ptr(), memory);
    assert!(merger.pop(false, &mut Batch::default).is_none());
}

#[test]
fn what_comes_later_than_the_look_ahead_is_delivered_and_counted() {
    let blocks = [vec![10, 11], vec![12], vec![13], vec![1, 2, 14]];
    let (out, late) = run(&blocks, lookahead(1, 100));
    let times: Vec<_> = out.iter().map(|(t, _)| *t).collect();
    assert_eq!(times, [10, 11, 12, 1, 2, 13, 14]);
    assert_eq!(late, 2);
}

proptest! {
    #[test]
    fn with_room_for_all_the_order_is_a_stable_sort(
        blocks in prop::collection::vec(prop::collection::vec(0u64..40, 0..12), 0..30),
    ) {
        let (out, late) = run(&blocks, lookahead(usize::MAX, usize::MAX >> 8));
        let mut expected = in_file_order(&blocks);
        expected.sort_by_key(|(t, _)| *t);
        prop_assert_eq!(out, expected);
        prop_assert_eq!(late, 0);
    }

    #[test]
    fn disorder_within_the_look_ahead_is_put_right(
        steps in prop::collection::vec((0u64..10, 0u64..60), 0..400),
        size in 1usize..20,
    ) {
        // Times advance by up to 9 and step back by up to 59: less than the 8 blocks of at least...
        // one item each cannot cover that, so the look-ahead is sized in items: 60 back is at most
        // the next 64 blocks even when each holds one item and time advances by one.
        let mut now = 100;
        let times: Vec<u64> = steps.iter().map(|(on, back)| { now += on.max(&1); now - back }).collect();
        let blocks: Vec<Vec<u64>> = times.chunks(size).map(<[u64]>::to_vec).collect();
        let (out, late) = run(&blocks, lookahead(64, 10_000));
        let mut expected = in_file_order(&blocks);
        expected.sort_by_key(|(t, _)| *t);
        prop_assert_eq!(late, 0);
        prop_assert_eq!(out, expected);
    }

    #[test]
    fn nothing_is_lost_or_doubled_and_late_means_late(
        blocks in prop::collection::vec(prop::collection::vec(0u64..1000, 0..12), 0..60),
        ahead in 0usize..6,
        held in 1usize..40,
    ) {
        let (out, late) = run(&blocks, lookahead(ahead, held));
        let mut reached = 0;
        let behind = out.iter().filter(|(t, _)| { let l = *t < reached; reached = reached.max(*t); l });
        prop_assert_eq!(late, behind.count() as u64);
        let mut sorted = out;
        sorted.sort_by_key(|(_, place)| *place);
        prop_assert_eq!(sorted, in_file_order(&blocks));
    }
}
