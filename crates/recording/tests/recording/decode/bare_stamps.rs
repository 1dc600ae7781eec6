//! Stamps that are bare numbers: one unit for all of a stream, or none.

use strapd_attitude::record::Nanos;
use strapd_attitude::record::TimeUnit;
use strapd_recording::decode::{Bare, decode_line, unit_of};

const UNITS: [(TimeUnit, &str, i64); 4] = [
    (TimeUnit::Nano, "ns", 1_000_000_000),
    (TimeUnit::Micro, "us", 1_000_000),
    (TimeUnit::Milli, "ms", 1_000),
    (TimeUnit::Second, "s", 1),
];

/// `from`, `from + step`, ..., every second one a tenth of a step late.
fn stream(from: i64, step: i64) -> impl Iterator<Item = Bare> {
    (0..9).map(move |n| Bare::whole(from + n * step + n % 2 * step / 10))
}

#[test]
fn every_unit_at_every_rate_is_found_or_refused_and_never_taken_for_another() {
    // In the year 2024, and a second, an hour and a day after a start.
    for start_secs in [1_714_000_000_i64, 0, 1, 3_600, 86_400] {
        for rate in [2_i64, 50, 100, 200, 400, 1_000, 4_000, 20_000] {
            for (unit, name, per_sec) in UNITS {
                let step = per_sec / rate;
                if step == 0 {
                    continue;
                }
                let found = unit_of(stream(start_secs * per_sec, step));
                let what = format!("{start_secs} s, {rate} Hz in {name}: {found:?}");
                if start_secs == 1_714_000_000 {
                    assert_eq!(found, Ok(unit), "{what}");
                } else {
                    assert!(found.is_err() || found == Ok(unit), "{what}");
                }
            }
        }
    }
    // A clock that begins at 0, in ns at 200 Hz, which its size would call seconds.
    assert_eq!(unit_of(stream(0, 5_000_000)), Ok(TimeUnit::Nano));
    let said = unit_of(stream(0, 1_000_000)).unwrap_err().to_string();
    for part in [
        "steps of 900000",
        "ns or us",
        "stamp_ns, stamp_us, stamp_ms or stamp_s",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn where_no_step_tells_the_instants_alone_do() {
    let same = |count| std::iter::repeat_n(Bare::whole(count), 9);
    assert_eq!(unit_of(same(1_714_000_000)), Ok(TimeUnit::Second));
    assert_eq!(unit_of(same(1_714_000_000_000)), Ok(TimeUnit::Milli));
    assert!(unit_of(same(5)).is_err());
    assert!(unit_of([]).is_err());
    assert!(unit_of([Bare::whole(i64::MIN), Bare::whole(i64::MAX)]).is_err());
}

#[test]
fn a_bare_number_keeps_every_nanosecond_until_its_unit_is_known() {
    let read = |stamp: &str| {
        let line = format!("{{\"stamp\":{stamp},\"gyro\":[0,0,1]}}");
        let mut out = Vec::new();
        let line = decode_line(line.as_bytes(), Nanos(5), &mut out).unwrap();
        assert_eq!((out.len(), line.bare.len()), (1, 1), "{stamp}");
        assert_eq!(out[0].header, None);
        line.bare[0].unwrap()
    };
    let exact = Nanos(1_700_000_000_123_456_789);
    assert_eq!(
        read("1700000000.123456789").in_unit(TimeUnit::Second),
        exact
    );
    assert_eq!(
        read("\"1700000000123.456789\"").in_unit(TimeUnit::Milli),
        exact
    );
    assert_eq!(read("1700000000123456789").in_unit(TimeUnit::Nano), exact);
    assert_eq!(
        read("1700000000123456789").certain_unit(),
        Some(TimeUnit::Nano)
    );
    assert_eq!(read("1700000000123456").certain_unit(), None);
    assert_eq!(read("-1.5").in_unit(TimeUnit::Nano), Nanos(-2));
    assert_eq!(read("1e300").in_unit(TimeUnit::Nano), Nanos(i64::MAX));
    // A name that says the unit needs nobody else.
    for (name, stamp) in [
        ("stamp_ns", "1700000000123456789"),
        ("stamp_us", "1700000000123456.789"),
        ("stamp_ms", "1700000000123.456789"),
        ("stamp_s", "1700000000.123456789"),
    ] {
        let line = format!("{{\"{name}\":{stamp},\"gyro\":[0,0,1]}}");
        let mut out = Vec::new();
        let line = decode_line(line.as_bytes(), Nanos(5), &mut out).unwrap();
        assert!(line.bare.is_empty());
        assert_eq!(out[0].header, Some(exact), "{name}");
    }
}

#[test]
fn what_looks_like_our_time_in_the_next_larger_unit_is_a_clock_of_11_to_47_days_at_500_hz_or_more()
{
    let day = 86_400;
    for (n, (unit, name, per_sec)) in UNITS.into_iter().enumerate().take(3) {
        let larger = UNITS[n + 1].0;
        for (days, rate, expected) in [
            (10, 1_000, None),
            (11, 1_000, Some(larger)),
            (20, 500, Some(larger)),
            (47, 500, Some(larger)),
            (48, 1_000, None),
            (20, 250, Some(unit)),
            (20, 100, Some(unit)),
        ] {
            let found =
                unit_of((0..9).map(|k| Bare::whole(days * day * per_sec + k * per_sec / rate)));
            assert_eq!(found.ok(), expected, "{days} days, {rate} Hz in {name}");
        }
    }
}

#[test]
fn a_number_no_clock_can_show_is_in_no_unit() {
    // Microseconds of our time, in pairs: as milliseconds it would be the year 55,000.
    let pairs = (0..9).map(|n| Bare::whole(1_700_000_000_000_000 + n / 2 * 5_000 + n % 2 * 3));
    assert!(unit_of(pairs).is_err());
}
