//! The end of a ZIP archive -> which of its members to take out. Pure.
//!
//! Apart because phones export a folder of tables as one archive: which of them holds the rates is the question.

use super::is_plain;
use crate::text::printable;

/// Mark of an entry of the directory at an archive's end, and its length without names.
const ENTRY: &[u8] = b"PK\x01\x02";
const ENTRY_LEN: usize = 46;

/// Mark of an archive that holds something.
pub(crate) const MARK: &[u8; 4] = b"PK\x03\x04";
/// Most members that are looked at.
pub(crate) const MOST: usize = 10_000;

/// The command that takes out the member most likely meant, as far as `last` tells.
pub(super) fn way_in(last: &[u8]) -> String {
    let names = members(last);
    let best = names.iter().filter_map(|name| Some((likely(name)?, name)));
    // The first of the best.
    let best = best.reduce(|best, next| if next.0 > best.0 { next } else { best });
    let Some((rank, best)) = best else {
        return "unzip FILE unpacks it; name the log inside".to_owned();
    };
    let (folder, own) = best.rsplit_once('/').unwrap_or(("", best));
    // A table of rates among others: they may have what corrects them.
    let tables = names.iter().filter_map(|name| likely(name)).count();
    if rank < LOG && tables > 1 && is_plain(best) {
        let of = |folder: &str| {
            format!(
                "unzip FILE -d unpacked, then name the folder {folder}: its tables are one recording"
            )
        };
        return match folder {
            "" => of("unpacked"),
            folder => of(&format!("unpacked/{folder}")),
        };
    }
    if !is_plain(best) {
        return format!(
            "unzip FILE unpacks it; name the log inside, which may be {:?}",
            printable(best)
        );
    }
    format!("unzip -p FILE {best} > {own} takes out the log inside; name that")
}

/// The names in the directory, as far as it lies within `last`.
fn members(last: &[u8]) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = last;
    while let Some(at) = memchr::memmem::find(rest, ENTRY) {
        rest = rest.get(at..).unwrap_or(&[]);
        let length = rest.get(28..30).and_then(<[u8]>::first_chunk);
        let length = length.map_or(0, |bytes| usize::from(u16::from_le_bytes(*bytes)));
        let Some(name) = rest.get(ENTRY_LEN..ENTRY_LEN + length) else {
            break;
        };
        if names.len() >= MOST {
            break;
        }
        names.push(String::from_utf8_lossy(name).into_owned());
        rest = rest.get(ENTRY_LEN + length..).unwrap_or(&[]);
    }
    names
}

/// The least of a member that is a log whole.
const LOG: u8 = 3;

/// Likelihood that a member is the one that is meant; `None` for what can be none.
fn likely(name: &str) -> Option<u8> {
    let name = name.to_ascii_lowercase();
    let own = name.rsplit('/').next().unwrap_or(&name);
    let (_, extension) = own.rsplit_once('.')?;
    let is_log = match extension {
        "mcap" | "bag" | "ulg" | "ulog" | "ndjson" | "jsonl" => LOG,
        "csv" | "tsv" | "txt" | "gcsv" => 0,
        _ => return None,
    };
    // Android's uncalibrated gyroscope has its bias in it.
    let is_gyro = match own.contains("gyro") {
        true if own.contains("uncalibrated") => 1,
        true => 2,
        false => 0,
    };
    Some(is_log + is_gyro)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn archive(names: &[&str]) -> Vec<u8> {
        let entry = |name: &&str| {
            let mut entry = ENTRY.to_vec();
            entry.resize(28, 0);
            entry.extend((name.len() as u16).to_le_bytes());
            entry.resize(ENTRY_LEN, 0);
            entry.extend_from_slice(name.as_bytes());
            entry
        };
        names.iter().flat_map(entry).collect()
    }

    #[test]
    fn the_tables_of_a_phones_archive_are_unpacked_together_and_a_log_is_taken_out() {
        let phone = [
            "Metadata.csv",
            "GyroscopeUncalibrated.csv",
            "Accelerometer.csv",
            "run/Gyroscope.csv",
        ];
        assert_eq!(
            way_in(&archive(&phone)),
            "unzip FILE -d unpacked, then name the folder unpacked/run: its tables are one recording"
        );
        assert!(
            way_in(&archive(&["Gyroscope.csv", "Accelerometer.csv"])).contains("folder unpacked:")
        );
        assert_eq!(
            way_in(&archive(&["a/gyro.csv"])),
            "unzip -p FILE a/gyro.csv > gyro.csv takes out the log inside; name that"
        );
        assert!(way_in(&archive(&["a.txt", "flight.ulg"])).contains("flight.ulg"));
        let odd = way_in(&archive(&["meta/device.csv", "Raw Data $(x) gyro.csv"]));
        assert!(odd.starts_with("unzip FILE unpacks it"), "{odd}");
        assert!(odd.contains("Raw Data"), "{odd}");
    }

    #[test]
    fn an_archive_that_tells_nothing_is_unpacked_whole() {
        for last in [
            &b""[..],
            b"PK\x01\x02",
            &archive(&["a.png", "b"]),
            &[0x50; 300],
        ] {
            assert_eq!(way_in(last), "unzip FILE unpacks it; name the log inside");
        }
        let mut cut = archive(&["Gyroscope.csv"]);
        cut.truncate(50);
        assert_eq!(way_in(&cut), "unzip FILE unpacks it; name the log inside");
    }
}
