//! The words a flag is completed with, though it takes other values, too. Pure.
//!
//! A stage of its own because clap knows either a list that is everything, or no list at all: a flag that takes `gravity` and
//! `q=1,0,0,0` could not be completed by a shell.

use super::setting_args;
use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use std::ffi::OsStr;
use strapd_attitude::noise::sensor_error::PRESETS;
use strapd_attitude::setting::SAMPLE_KIND;
use strapd_bodies::top::Case;
use strapd_bodies::top::method_errors::case;

/// A parser of values, and the words among them that a shell offers. Its flag says `hide_possible_values`, as its help
/// names them and what else there is.
#[derive(Clone, Debug)]
pub(super) struct KnownWords<P> {
    words: Vec<&'static str>,
    parser: P,
}

impl<P: TypedValueParser> TypedValueParser for KnownWords<P> {
    type Value = P::Value;

    fn parse_ref(
        &self,
        command: &clap::Command,
        flag: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<P::Value, clap::Error> {
        self.parser.parse_ref(command, flag, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(self.words.iter().map(PossibleValue::new)))
    }
}

fn text(words: impl IntoIterator<Item = &'static str>) -> KnownWords<StringValueParser> {
    KnownWords {
        words: words.into_iter().collect(),
        parser: StringValueParser::new(),
    }
}

/// Words of `--sample-kind`, as of what estimates.
pub(super) fn sample_kind() -> PossibleValuesParser {
    setting_args::words(SAMPLE_KIND)
}

/// `--speed`.
pub(super) fn speed() -> KnownWords<StringValueParser> {
    text(["max", "1"])
}

/// `--noise` of what simulates: sensors.
pub(super) fn noise_of_a_sensor() -> KnownWords<StringValueParser> {
    text(
        ["none"]
            .into_iter()
            .chain(PRESETS.iter().map(|preset| preset.name)),
    )
}

/// A value by its name, or why there is none.
type ByName<T> = fn(&str) -> Result<T, String>;

/// `--case` of a top.
pub(super) fn top_case() -> KnownWords<ByName<Case>> {
    KnownWords {
        words: Case::ALL.iter().map(|case| case.name()).collect(),
        parser: case,
    }
}
