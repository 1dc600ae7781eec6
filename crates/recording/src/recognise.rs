//! First and last bytes of an input that is not read -> what it is, and the way in. Pure.
//!
//! A stage of its own because the name of a file says little: logs come as `.log`, `.bin`, `.dat`, or packed.
//! What is known but not read is told with the command that makes something of it that is.

use strapd_attitude::setting::COLUMNS;

pub(crate) mod zip;

/// Number of a file's first bytes that are looked at. Of a stream eight are enough for most.
pub const FIRST: usize = 1024;

/// Number of its last bytes that tell what an archive holds.
pub const LAST: usize = 64 << 10;

/// A known format that is not read.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Foreign {
    /// Name with its article: `a ZIP archive`.
    pub name: &'static str,
    /// Advice, where FILE is the input.
    way_in: String,
}

impl Foreign {
    /// Advice with commands that name the input, where its name can stand in a command as it is.
    #[must_use]
    pub fn help(&self, input: &str) -> String {
        match is_plain(input) {
            true => self.way_in.replace("FILE", input),
            false => self.way_in.clone(),
        }
    }
}

/// Whether `word` can stand in a shell's command without quotes.
fn is_plain(word: &str) -> bool {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"_@%+:,./-".contains(&b);
    !word.is_empty() && !word.starts_with('-') && word.bytes().all(plain)
}

/// Row of a known format: where its mark is, the mark, its name, and the way in.
type FormatMark = (usize, &'static [u8], &'static str, &'static str);

const LINES: &str =
    "write a line {\"stamp_s\": T, \"gyro\": [X, Y, Z]} for each sample into a file .ndjson";

/// Way in where there is none.
const NO_SAMPLES: &str = "it holds no samples of a gyro: name the recording";

const KNOWN: &[FormatMark] = &[
    (
        0,
        b"rosbag2_",
        "the metadata of a rosbag2 recording",
        "name the .mcap or .db3 file beside it, or the folder of both",
    ),
    (
        0,
        b"#ROSBAG ",
        "a ROS bag of a version before 2.0",
        "rosbag fix FILE new.bag",
    ),
    (
        0,
        b"FMT, 128",
        "an ArduPilot DataFlash log (text)",
        "pip install pymavlink; mavlogdump.py --types IMU --format json FILE > imu.ndjson; \
         strapd replay imu.ndjson --body frd",
    ),
    (
        0,
        b"H Produc",
        "a Betaflight or INAV blackbox log",
        "blackbox_decode FILE writes it as CSV",
    ),
    (
        4,
        b"ftyp",
        "a video (MP4, MOV) without the telemetry of a GoPro, or cut before its index",
        "Gyroflow exports the camera's motion data as CSV",
    ),
    (
        0,
        b"\x89HDF\r\n\x1a\n",
        "an HDF5 file (also .mat of MATLAB 7.3)",
        "h5py reads it in Python",
    ),
    (
        0,
        b"MATLAB 7",
        "an HDF5 file (.mat of MATLAB 7.3)",
        "h5py reads it in Python",
    ),
    (
        0,
        b"MATLAB 5",
        "a MATLAB file (.mat)",
        "scipy.io.loadmat reads it in Python",
    ),
    (
        0,
        b"\x93NUMPY",
        "a NumPy array (.npy)",
        "numpy.load reads it in Python",
    ),
    (0, b"ARROW1", "an Arrow file", "pyarrow reads it in Python"),
    (
        0,
        &[0x1f, 0x8b],
        "a file packed with gzip",
        "gunzip -c FILE > log, or gunzip -c FILE | strapd replay -",
    ),
    (
        0,
        b"BZh",
        "a file packed with bzip2",
        "bunzip2 -c FILE > log, or bunzip2 -c FILE | strapd replay -",
    ),
    (
        0,
        &[0xfd, b'7', b'z', b'X', b'Z', 0],
        "a file packed with xz",
        "xz -dc FILE > log, or xz -dc FILE | strapd replay -",
    ),
    (
        0,
        &[0x28, 0xb5, 0x2f, 0xfd],
        "a file packed with zstd",
        "zstd -dc FILE > log, or zstd -dc FILE | strapd replay -",
    ),
    (
        0,
        &[0x04, 0x22, 0x4d, 0x18],
        "a file packed with lz4",
        "lz4 -dc FILE > log, or lz4 -dc FILE | strapd replay -",
    ),
    (
        0,
        &[b'7', b'z', 0xbc, 0xaf, 0x27, 0x1c],
        "a 7-Zip archive",
        "7z x FILE unpacks it; name the log inside",
    ),
    (
        0,
        b"Rar!\x1a\x07",
        "a RAR archive",
        "unrar x FILE unpacks it; name the log inside",
    ),
    (
        257,
        b"ustar",
        "a TAR archive",
        "tar -xf FILE unpacks it; name the log inside",
    ),
    (
        0,
        &[0xff, 0xfe],
        "text in UTF-16",
        "iconv -f UTF-16 -t UTF-8 FILE > log.csv",
    ),
    (
        0,
        &[0xfe, 0xff],
        "text in UTF-16",
        "iconv -f UTF-16 -t UTF-8 FILE > log.csv",
    ),
    (0, b"\x89PNG\r\n", "a picture (PNG)", NO_SAMPLES),
    (0, &[0xff, 0xd8, 0xff], "a picture (JPEG)", NO_SAMPLES),
    (0, b"GIF8", "a picture (GIF)", NO_SAMPLES),
    (0, b"%PDF-", "a document (PDF)", NO_SAMPLES),
    (0, b"\x7fELF", "a program", NO_SAMPLES),
    (
        0,
        b"version https://git-lfs",
        "a pointer of Git LFS in place of the file itself",
        "git lfs pull fetches it",
    ),
];

/// Formats that are only text when written as lines.
const AS_LINES: &[&str] = &["HDF5", "MATLAB", "NumPy", "Arrow", "blackbox", "video"];

/// Format of a file that begins and ends with these bytes, when it is known and not read.
#[must_use]
pub fn foreign(first: &[u8], last: &[u8]) -> Option<Foreign> {
    marked(first, last).or_else(|| text(first))
}

/// The same of what has a mark that text cannot have by chance: all that may be asked of a stream, which may
/// begin in the middle of a line. Fewer bytes tell less.
#[must_use]
pub fn marked(first: &[u8], last: &[u8]) -> Option<Foreign> {
    if first.starts_with(zip::MARK) || first.starts_with(b"PK\x05\x06") {
        return of("a ZIP archive", &zip::way_in(last));
    }
    let has =
        |(at, mark, ..): &&FormatMark| first.get(*at..).is_some_and(|rest| rest.starts_with(mark));
    if let Some((_, _, name, way_in)) = KNOWN.iter().find(has) {
        let as_lines = AS_LINES.iter().any(|part| name.contains(part));
        return match as_lines {
            true => of(name, &format!("{way_in}; {LINES}")),
            false => of(name, way_in),
        };
    }
    let text = first.trim_ascii_start();
    if starts_like(text, b"<!doctype") || starts_like(text, b"<html") {
        return of(
            "a web page, as is saved in place of a log that was not to be had",
            "download the log itself",
        );
    }
    let head = text.get(..text.len().min(600)).unwrap_or(text);
    let mut elements = MARKED_UP.iter().filter(|_| head.starts_with(b"<"));
    if let Some((_, name)) = elements.find(|(word, _)| contains(head, word)) {
        return of(name, NO_SAMPLES);
    }
    if starts_like(text, b"<?xml") {
        return of("a text in XML", NO_SAMPLES);
    }
    None
}

/// Texts in XML, by an element near their beginning.
const MARKED_UP: [(&[u8], &str); 4] = [
    (b"<gpx", "a track of positions (GPX)"),
    (b"<kml", "places of a map (KML)"),
    (b"<svg", "a picture (SVG)"),
    (b"<trainingcenterdatabase", "a training (TCX)"),
];

fn contains(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len())
        .any(|part| part.eq_ignore_ascii_case(word))
}

fn of(name: &'static str, way_in: &str) -> Option<Foreign> {
    let way_in = way_in.to_owned();
    Some(Foreign { name, way_in })
}

/// Text that is no lines of objects.
fn text(first: &[u8]) -> Option<Foreign> {
    is_table(first).then_some(())?;
    of(
        "a table of text",
        &format!(
            "call it .csv, and say what its columns are: {COLUMNS} gyro=NAME:NAME:NAME,stamp=NAME:UNIT (docs/inputs.md)"
        ),
    )
}

fn starts_like(text: &[u8], word: &[u8]) -> bool {
    text.get(..word.len())
        .is_some_and(|head| head.eq_ignore_ascii_case(word))
}

/// Whether it is text of which some line has three cells or more.
fn is_table(first: &[u8]) -> bool {
    let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first);
    let binary = |b: &u8| *b < b' ' && !b"\t\r\n".contains(b);
    if text.is_empty() || text.iter().any(binary) {
        return false;
    }
    let cells = |line: &[u8]| {
        let of = |separator: u8| line.iter().filter(|b| **b == separator).count();
        b"\t,;|".iter().map(|separator| of(*separator)).max()
    };
    !text.starts_with(b"{")
        && text
            .split(|b| *b == b'\n')
            .any(|line| cells(line) >= Some(2))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn name(first: &[u8]) -> Option<&'static str> {
        foreign(first, &[]).map(|found| found.name)
    }

    #[test]
    fn each_format_is_known_by_its_first_bytes_and_told_with_a_way_in() {
        for (_, mark, expected, _) in KNOWN.iter().filter(|(at, ..)| *at == 0) {
            let mut first = mark.to_vec();
            first.extend([0; 20]);
            assert_eq!(name(&first), Some(*expected), "{mark:x?}");
            // What a pipe shows of it before the rest must be waited for.
            first.truncate(mark.len().max(8));
            assert_eq!(name(&first), Some(*expected), "{mark:x?}");
            assert!(!foreign(&first, &[]).unwrap().help("x").contains("FILE"));
        }
        let mut tar = b"flight.mcap".to_vec();
        tar.resize(257, 0);
        tar.extend_from_slice(b"ustar\0");
        assert_eq!(name(&tar), Some("a TAR archive"));
        assert_eq!(
            name(b"\0\0\0\x14ftypmp42"),
            Some("a video (MP4, MOV) without the telemetry of a GoPro, or cut before its index")
        );
        assert!(name(b"\n <!DOCTYPE HTML><p>").unwrap().contains("web page"));
        let track = b"<?xml version=\"1.0\"?>\n<gpx version=\"1.1\"><trk>";
        assert_eq!(name(track), Some("a track of positions (GPX)"));
        assert_eq!(name(b"<svg width=\"3\">"), Some("a picture (SVG)"));
        assert_eq!(name(b"<?xml version=\"1.0\"?><a/>"), Some("a text in XML"));
        for table in [
            &b"time,gyro_x,gyro_y\n1,2,3"[..],
            b"\xef\xbb\xbf\"Time (s)\";\"Gyroscope x (rad/s)\";\"y\"\r\n",
            b"// Start Time: 0\n// Sample rate: 100\nPacketCounter\tGyr_X\tGyr_Y\n",
        ] {
            assert_eq!(name(table), Some("a table of text"));
        }
    }

    #[test]
    fn what_is_nothing_of_these_is_not_called_so() {
        for first in [
            &b""[..],
            b"\x89MCAP0\r\n",
            b"hello\nworld\n",
            b"{\"gyro\":[1,2,3],\"stamp_s\":4}\n{\"gyro\":[1,2,3],\"stamp_s\":5}\n",
            b"\x00\x01,,,\n",
            &[0; 64],
        ] {
            assert_eq!(name(first), None, "{first:x?}");
        }
        // A stream of lines that begins in the middle of one.
        assert_eq!(marked(b"0.1,0.2],\"t\":3}\n", &[]), None);
    }

    #[test]
    fn a_command_names_the_file_only_where_a_shell_takes_it_as_one_word() {
        let gzip = foreign(&[0x1f, 0x8b], &[]).unwrap();
        assert!(
            gzip.help("a/log.gz")
                .contains("gunzip -c a/log.gz | strapd")
        );
        for odd in ["a b", "$(reboot)", "-rf", "x;y", "'", "\u{1b}[2J"] {
            assert!(gzip.help(odd).contains("gunzip -c FILE | strapd"), "{odd}");
        }
    }
}
