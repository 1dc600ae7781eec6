//! First lines without a header -> why they are no table, and what would help. Pure.
//!
//! Apart from the layout because it looks at the lines once more, for the one that comes closest to a header.

use super::candidates::place;
use super::header::names_in;
use super::{Opening, is_number};
use crate::columns::{Columns, Delimiter, Kind, Meant, Name};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{COLUMNS, DELIMITER};

/// Names that an error repeats.
const MOST_SAID: usize = 16;

impl Opening {
    /// Refusal of a text without a header: what there is, and what would help.
    pub(super) fn nothing(&self) -> Diagnostic {
        let start = self.lines.first().map_or(&[][..], Vec::as_slice);
        if self.lines.iter().flatten().any(|b| *b == 0) {
            return Diagnostic::new(
                "it holds bytes of zero: it is binary, or UTF-16 without its mark",
            )
            .help("iconv -f UTF-16LE -t UTF-8 FILE > log.csv, if it is text");
        }
        // The line with the most names.
        let texts = |names: &[Name]| names.iter().filter(|name| !is_number(&name.text)).count();
        let best = self
            .lines
            .iter()
            .filter_map(|line| {
                let mut tried = self.delimiter.into_iter().chain(Delimiter::TRIED);
                tried.find_map(|delimiter| {
                    Some(names_in(line, delimiter)).filter(|names| names.len() >= 3)
                })
            })
            .filter(|names| texts(names) > 0)
            .max_by_key(|names| texts(names));
        let Some(names) = best else {
            return Diagnostic::new(format!(
                "none of its first lines has three cells that could name columns; it begins with `{}`",
                crate::text::snippet(start)
            ))
            .help(format!(
                "a first row with names such as time_s, gyro_x, gyro_y, gyro_z; or {COLUMNS} gyro=2:3:4,stamp=1:s by numbers, and {DELIMITER}"
            ));
        };
        let all: Vec<&str> = names.iter().map(|name| name.text.as_str()).collect();
        let said = all
            .get(..all.len().min(MOST_SAID))
            .unwrap_or(&all)
            .join("`, `");
        self.unnamed(&names, &all, &said)
    }

    /// Refusal of columns with names of which none is a rate; `all` are the names, `said` as many as are quoted.
    fn unnamed(&self, names: &[Name], all: &[&str], said: &str) -> Diagnostic {
        if let Some(given) = self.given.as_ref().map(Columns::all) {
            let wrong = given.iter().flat_map(|given| &given.columns);
            let wrong: Vec<String> = wrong
                .filter_map(|column| place(names, column).err())
                .collect();
            if let Some(first) = wrong.first() {
                return format!("{COLUMNS}: {first}; its columns are `{said}`").into();
            }
        }
        let axes = ["x", "y", "z"];
        if axes
            .iter()
            .all(|axis| all.iter().any(|name| name.eq_ignore_ascii_case(axis)))
        {
            return Diagnostic::new(
                "its columns x, y, z do not say of which sensor they are (they are rates where the file is called Gyroscope... or AngularVelocity)",
            )
            .help(format!(
                "{COLUMNS} gyro=x:y:z if they are rates"
            ));
        }
        let aside = names.iter().find_map(|name| match name.meant {
            Meant::Aside {
                kind: Kind::Gyro,
                why,
            } => Some(format!("; `{}` {why}", name.text)),
            _ => None,
        });
        Diagnostic::new(format!(
            "none of its columns names a rate about x, y and z, or a quaternion: `{said}`{}",
            aside.unwrap_or_default()
        ))
        .help(format!(
            "{COLUMNS} gyro=NAME:NAME:NAME,stamp=NAME:UNIT says which they are (or numbers, from 1); of attitudes orientation=W:X:Y:Z"
        ))
    }
}
