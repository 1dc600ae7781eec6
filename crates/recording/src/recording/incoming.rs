//! A stream that comes once -> messages, or lines, by its first bytes. I/O.
//!
//! Apart from the input that can be read again because nothing is kept: who reads it so takes its samples as they come.

use super::input::Input;
use super::line_input;
use super::warn::Warn;
use crate::decode::Options;
use crate::error::{Error, Result};
use crate::format::{Format, head_of};
use crate::lines::Lines;
use crate::mcap::Reader;
use crate::recognise;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

/// Stream, told by its first bytes.
#[derive(Debug)]
pub enum Incoming<R> {
    /// Messages on channels.
    Messages(Reader),
    /// Lines or rows.
    Lines(Box<Lines<R>>),
    /// A log that is not read in the order of its bytes: all of it, kept.
    Whole(Input),
}

/// Whether a stream holds messages or lines; `name` is what errors call it. No more is read than tells it, but
/// of a log that cannot be read as it comes; then `warn` is told what [`Input::of_stream`] has to say.
///
/// # Errors
/// It cannot be read, is empty, or of a format that is known and not read; options that are not for its format.
pub fn incoming<R: Read + Send + 'static>(
    name: &Path,
    input: R,
    options: &Options,
    warn: &Warn,
) -> Result<Incoming<impl Read + use<R>>> {
    let mut input = BufReader::with_capacity(1 << 16, input);
    let head = head_of(&mut input).map_err(|source| Error::Read {
        path: name.to_owned(),
        offset: 0,
        source,
    })?;
    if head.is_empty() {
        return Err(Error::Empty {
            path: name.to_owned(),
        });
    }
    let known = Format::of_bytes(&head);
    if let Some(format) = recognise::marked(&head, &[]).filter(|_| known.is_none()) {
        let path = name.to_owned();
        return Err(Error::NotRead { path, format });
    }
    // What has no name and tells nothing may still be lines, of which the first is damaged.
    let shape = || Format::of_shape(&head);
    let format = known.or_else(shape).unwrap_or(Format::Lines);
    let whole = Cursor::new(head).chain(input);
    if format.is_text() && !format.is_read_anywhere() {
        let lines = line_input::open(name, format, whole, options)?;
        return Ok(Incoming::Lines(Box::new(lines)));
    }
    if !format.is_table() {
        line_input::only_for_tables(name, format, options)?;
    }
    if format.is_read_anywhere() {
        return Ok(Incoming::Whole(Input::of_stream(name, whole, warn)?));
    }
    Ok(Incoming::Messages(Reader::from_stream(
        name,
        Box::new(whole),
    )?))
}
