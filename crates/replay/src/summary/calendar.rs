//! Seconds and stamps -> the words people use for them. Pure.

use strapd_attitude::record::Nanos;

/// `1 h 2 min 3 s`, or seconds with decimals below a minute.
#[must_use]
pub fn duration(secs: f64) -> String {
    if secs < 60.0 {
        return format!("{secs:.3} s");
    }
    let whole = secs.round() as u64;
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    match hours {
        0 => format!("{minutes} min {seconds} s"),
        _ => format!("{hours} h {minutes} min {seconds} s"),
    }
}

/// RFC 3339 in UTC when the clock can be Unix time (after 2000), else `None`: a boot clock has no
/// date. Days to date after Hinnant, "chrono-compatible low-level date algorithms", 2013.
#[must_use]
pub fn date(unix_nanos: u64) -> Option<String> {
    const Y2000: i64 = 946_684_800;
    let stamp = Nanos(i64::try_from(unix_nanos).ok()?);
    let (secs, _) = stamp.to_sec_nanosec();
    if secs < Y2000 {
        return None;
    }
    let days = secs.div_euclid(86_400) + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 {
        shifted_month + 3
    } else {
        shifted_month - 9
    };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let second = secs.rem_euclid(86_400);
    Some(format!(
        "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z",
        second / 3600,
        second / 60 % 60,
        second % 60
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        let at = |secs: u64| date(secs * 1_000_000_000);
        assert_eq!(at(1_700_000_000).as_deref(), Some("2023-11-14T22:13:20Z"));
        assert_eq!(at(951_782_400).as_deref(), Some("2000-02-29T00:00:00Z"));
        assert_eq!(at(4_102_444_799).as_deref(), Some("2099-12-31T23:59:59Z"));
        assert_eq!(at(12_345), None, "a boot clock has no date");
    }

    #[test]
    fn durations_read_well() {
        assert_eq!(duration(1.25), "1.250 s");
        assert_eq!(duration(3725.0), "1 h 2 min 5 s");
    }
}
