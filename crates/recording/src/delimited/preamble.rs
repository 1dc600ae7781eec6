//! The lines before a header -> what they say of the numbers. Pure.
//!
//! Apart from the header because each maker has a head of its own: rates of exports without stamps, factors of
//! `.gcsv`, whose file it is.

/// Maker as far as it is known, with the units that its documents give to columns that state none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Maker {
    #[default]
    Unknown,
    /// Xsens MT Manager: rad/s, m/s^2.
    Xsens,
    /// Xsens (Movella) DOT: deg/s, m/s^2.
    Dot,
    /// gyroflow's `.gcsv`: factors in its head.
    Gyroflow,
}

/// A rate of samples, and the line that says it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Rate {
    pub(super) hz: f64,
    pub(super) said: String,
}

/// Lines before the header.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Preamble {
    pub(super) maker: Maker,
    pub(super) rate: Option<Rate>,
    /// Seconds, rad/s, standard gravities, gauss in one count.
    pub(super) tscale: Option<f64>,
    pub(super) gscale: Option<f64>,
    pub(super) ascale: Option<f64>,
    pub(super) mscale: Option<f64>,
    /// The axes that a `.gcsv` names, as `--body` takes them.
    pub(super) orientation: Option<String>,
    /// Whether strapd wrote it: its columns are those of the body, and the letters are for Gyroflow alone.
    pub(super) is_ours: bool,
}

/// Names of a rate of samples, without blanks and `_`.
const RATES: [&str; 9] = [
    "updaterate",
    "outputrate",
    "samplingrate",
    "samplerate",
    "samplingfrequency",
    "samplefrequency",
    "outputdatarate",
    "outputfrequency",
    "datarate",
];

/// The rate that a line says: `// Sample rate: 50.0Hz`.
pub(super) fn rate(line: &[u8]) -> Option<Rate> {
    let text = String::from_utf8_lossy(line.get(..line.len().min(256))?);
    let said = text.trim_matches(|c: char| c.is_whitespace() || "#/%,;".contains(c));
    let (name, value) = said.split_once([':', '=', ',', '\t', ';'])?;
    let name: String = name
        .chars()
        .filter(|c| c.is_ascii_alphabetic())
        .collect::<String>()
        .to_lowercase();
    RATES.contains(&name.as_str()).then_some(())?;
    let value = value.trim_start_matches(|c: char| c.is_whitespace() || ":=,;".contains(c));
    let end = value.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = value.split_at(end.unwrap_or(value.len()));
    let is_hertz = unit.trim_end().is_empty() || unit.trim_start().to_lowercase().starts_with("hz");
    let hz: f64 = number.parse().ok()?;
    (is_hertz && (0.01..1e6).contains(&hz)).then(|| Rate {
        hz,
        said: crate::text::printable(said),
    })
}

impl Preamble {
    /// Reads these lines.
    pub(super) fn of<'l>(lines: impl Iterator<Item = &'l [u8]>) -> Preamble {
        let mut found = Preamble::default();
        for line in lines {
            let text = String::from_utf8_lossy(line.get(..line.len().min(1024)).unwrap_or(line));
            let text = text.trim().trim_start_matches('\u{feff}');
            found.rate = found.rate.or_else(|| rate(line));
            let small = text.to_lowercase();
            if small.starts_with("gyroflow imu log") || small.starts_with("camera imu log") {
                found.maker = Maker::Gyroflow;
            } else if small.contains("xsens dot")
                || small.contains("movella dot")
                || small.starts_with("devicetag")
            {
                found.maker = Maker::Dot;
            } else if text.starts_with("//") && found.maker == Maker::Unknown {
                found.maker = Maker::Xsens;
            }
            if found.maker == Maker::Gyroflow
                && let Some((name, value)) = text.split_once(',')
            {
                let value = value.trim();
                let number = value
                    .parse()
                    .ok()
                    .filter(|n: &f64| n.is_finite() && *n > 0.0);
                match name.trim() {
                    "tscale" => found.tscale = number,
                    "gscale" => found.gscale = number,
                    "ascale" => found.ascale = number,
                    "mscale" => found.mscale = number,
                    "orientation" => found.orientation = Some(crate::text::printable(value)),
                    "vendor" => found.is_ours = value == "strapd",
                    _ => {}
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_read_wherever_makers_put_it_and_nowhere_else() {
        for (line, hz) in [
            ("// Sample rate: 50.0Hz", Some(50.0)),
            ("//Update Rate: 40.0Hz\r\n", Some(40.0)),
            ("OutputRate:,60Hz,", Some(60.0)),
            ("# sample_rate = 200", Some(200.0)),
            ("Sampling Rate\t100 Hz", Some(100.0)),
            ("// Start Time: 0", None),
            ("Update Rate: 2 minutes", None),
            ("Update Rate: 0", None),
            ("1,2,3", None),
        ] {
            assert_eq!(rate(line.as_bytes()).map(|rate| rate.hz), hz, "{line}");
        }
    }
}
