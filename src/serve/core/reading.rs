//! Parameters of an address -> how the lines of its connections are read. Pure.
//!
//! Apart from the sessions because all connections of a listener share it, and each source has its own.

use crate::serve::protocol::wire::MAX_ID;
use strapd_recording::decode::{LineDecoder, Options, exact_name};
use strapd_recording::delimited::{Columns, Delimiter, RowFilter};
use strapd_recording::devices::Asked;

/// Parameters of an address that say how its lines are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineParameters {
    /// Name of the sensor of a line that names none (`?id=`).
    pub id: Option<String>,
    /// Columns of a table (`?columns=`).
    pub columns: Option<Columns>,
    /// Delimiter between its cells (`?delimiter=`).
    pub delimiter: Option<Delimiter>,
    /// Rows that are read (`?where=`).
    pub rows: Vec<RowFilter>,
    /// Whether a sample without a stamp has that of its arrival (`?stamp=arrival`).
    pub by_arrival: bool,
    /// Protocol of its bytes (`?protocol=`).
    pub protocol: Asked,
}

impl LineParameters {
    /// Names of the parameters.
    pub const KEYS: [&str; 6] = ["id", "columns", "delimiter", "where", "stamp", "protocol"];
    /// Help for an address with others.
    pub const HELP: &str = "?id=NAME names the sensor; ?columns=ROLE=NAMES,..., ?delimiter=MARK and ?where=COLUMN=VALUE read rows of a table; ?stamp=arrival stamps samples without a stamp when they come; ?protocol=NAME reads frames of an autopilot or sensor";

    /// Reads the parameters among those of an address.
    ///
    /// # Errors
    /// In words: one that is given twice, or says nothing that can be.
    pub fn parse(parameters: &[(String, String)]) -> Result<LineParameters, String> {
        let of = |name: &str| {
            let mut values = parameters.iter().filter(|(n, _)| n == name);
            match (values.next(), values.next()) {
                (Some(_), Some(_)) => Err(format!("?{name}= is given twice")),
                (value, _) => Ok(value.map(|(_, value)| value.as_str())),
            }
        };
        let id = match of("id")? {
            Some(id) if id.is_empty() || id.len() > MAX_ID => {
                return Err(format!("?id= needs a name of 1 to {MAX_ID} bytes"));
            }
            id => id
                .map(exact_name)
                .transpose()
                .map_err(|why| format!("?id=: {why}"))?,
        };
        let parsed = |name: &'static str, why: String| format!("?{name}=: {why}");
        let columns = of("columns")?.map(str::parse).transpose();
        let delimiter = of("delimiter")?.map(str::parse).transpose();
        let rows = parameters.iter().filter(|(name, _)| name == "where");
        let rows = rows.map(|(_, value)| value.parse());
        Ok(LineParameters {
            id,
            columns: columns.map_err(|why| parsed("columns", why))?,
            delimiter: delimiter.map_err(|why| parsed("delimiter", why))?,
            rows: rows
                .collect::<Result<_, String>>()
                .map_err(|why| parsed("where", why))?,
            by_arrival: match of("stamp")? {
                None => false,
                Some("arrival") => true,
                Some(other) => {
                    let other = strapd_recording::text::printable(other);
                    return Err(format!("?stamp={other}: arrival is the one there is"));
                }
            },
            protocol: match of("protocol")? {
                None => Asked::Lines,
                Some(name) => Asked::parse(name).map_err(|why| format!("?protocol={why}"))?,
            },
        })
    }
}

impl LineParameters {
    /// The same, where an address says nothing with those `by_default`.
    #[must_use]
    pub fn or(self, by_default: &LineParameters) -> LineParameters {
        LineParameters {
            id: self.id.or_else(|| by_default.id.clone()),
            columns: self.columns.or_else(|| by_default.columns.clone()),
            delimiter: self.delimiter.or(by_default.delimiter),
            rows: match self.rows.is_empty() {
                true => by_default.rows.clone(),
                false => self.rows,
            },
            by_arrival: self.by_arrival || by_default.by_arrival,
            protocol: match self.protocol {
                Asked::Lines => by_default.protocol,
                stated => stated,
            },
        }
    }
}

/// Way in which the lines of a connection are read.
#[derive(Debug)]
pub struct Reading {
    /// Name of the sensor of a line that names none.
    pub(super) id: Option<String>,
    /// Options for rows.
    pub(super) options: Options,
    /// Decoder of objects.
    pub(super) decoder: LineDecoder,
    /// Whether a sample without a stamp has that of its arrival.
    pub(super) by_arrival: bool,
    /// Protocol of its bytes.
    pub(super) protocol: Asked,
    /// Whether lines that are no objects may be rows of a table.
    takes_rows: bool,
    /// Whether the bytes may begin within a line.
    pub(super) is_midway: bool,
}

impl Reading {
    /// Makes one of the options of a daemon, and of what an address says beside them.
    #[must_use]
    pub fn new(options: &Options, asked: &LineParameters) -> Reading {
        let mut options = options.clone();
        options.columns = asked.columns.clone().or(options.columns);
        options.delimiter = asked.delimiter.or(options.delimiter);
        // A sample without a stamp has one by then.
        options.are_stamps_unread |= asked.by_arrival;
        if !asked.rows.is_empty() {
            options.rows.clone_from(&asked.rows);
        }
        Reading {
            id: asked.id.clone(),
            decoder: LineDecoder::new(&options).with_besides(),
            options,
            by_arrival: asked.by_arrival,
            protocol: asked.protocol,
            takes_rows: matches!(asked.protocol, Asked::Lines | Asked::Auto),
            is_midway: false,
        }
    }

    /// The same of objects alone.
    #[must_use]
    pub fn of_objects(self) -> Reading {
        Reading {
            takes_rows: false,
            ..self
        }
    }

    /// The same of bytes that may begin within a line.
    #[must_use]
    pub fn joined_midway(self) -> Reading {
        Reading {
            is_midway: true,
            ..self
        }
    }

    /// Decoder of objects.
    #[must_use]
    pub fn decoder(&self) -> &LineDecoder {
        &self.decoder
    }

    /// Whether lines that are no objects may be rows of a table.
    #[must_use]
    pub(super) fn takes_rows(&self) -> bool {
        self.takes_rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(query: &str) -> Result<LineParameters, String> {
        let parameters = crate::client::remote::parameters(query);
        LineParameters::parse(&parameters.unwrap_or_default())
    }

    #[test]
    fn an_address_says_how_its_lines_are_read() {
        let query = "id=left&columns=gyro=2:3:4:deg/s,stamp=1:ms&delimiter=tab&where=device=a&stamp=arrival";
        let read = parsed(query).unwrap_or_default();
        assert_eq!(read.id.as_deref(), Some("left"));
        assert!(read.by_arrival && read.columns.is_some() && read.delimiter.is_some());
        assert_eq!(read.rows.len(), 1);
        for (query, words) in [
            ("id=", "1 to 255 bytes"),
            ("id=a&id=b", "?id= is given twice"),
            ("columns=gyros=1:2:3", "?columns=: `gyros` is no role"),
            ("delimiter=7", "?delimiter=: one of tab"),
            ("where=device", "?where=: `device` is no COLUMN=VALUE"),
            ("stamp=ntp", "?stamp=ntp: arrival"),
            (
                "protocol=morse",
                "?protocol=morse: one of auto, mavlink, ximu3, xsens",
            ),
            ("protocol=bno08x-rvc", "no rate"),
        ] {
            let why = parsed(query).err().unwrap_or_default();
            assert!(why.contains(words), "{query}: {why}");
        }
    }
}
