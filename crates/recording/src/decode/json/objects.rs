//! One body of JSON -> the objects in it, each as a line would hold it. Pure.
//!
//! Apart from the framing of streams because a body has an end, and so may be one object over many
//! lines, or an array, which no stream of lines is.

use super::scan::Scanner;
use crate::decode::Undecodable;

/// An object of a body.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Object<'a> {
    /// Number of the object, from 1: the line, or the element of the array.
    pub number: u64,
    /// Bytes; whether they are an object is not known of a line.
    pub bytes: &'a [u8],
}

/// Goes through the objects of a body.
#[derive(Debug)]
pub struct Objects<'a> {
    number: u64,
    rest: Rest<'a>,
}

#[derive(Debug)]
enum Rest<'a> {
    One(&'a [u8]),
    /// The scanner stands before the next element; whether that is the first.
    Elements(Scanner<'a>, bool),
    Lines(&'a [u8]),
    Broken(Undecodable),
    Nothing,
}

impl<'a> Objects<'a> {
    /// Makes one of lines.
    #[must_use]
    pub fn lines(body: &'a [u8]) -> Objects<'a> {
        Objects {
            number: 0,
            rest: Rest::Lines(body),
        }
    }

    /// Makes one of JSON: one object, or an array of them; several objects one after the other are lines.
    #[must_use]
    pub fn json(body: &'a [u8]) -> Objects<'a> {
        let rest = json(body).unwrap_or_else(Rest::Broken);
        Objects { number: 0, rest }
    }

    fn element(&mut self, mut scanner: Scanner<'a>, mut first: bool) -> Option<Item<'a>> {
        let mut start = scanner.position();
        let next = scanner.element(&mut first).and_then(|goes_on| {
            if !goes_on {
                return scanner.end().map(|()| None);
            }
            scanner.peek();
            start = scanner.position();
            scanner.skip(1)?;
            Ok(Some(scanner.since(start)))
        });
        match next {
            Ok(None) => None,
            Ok(Some(bytes)) => {
                self.rest = Rest::Elements(scanner, first);
                Some(Ok(Object {
                    number: self.number,
                    bytes,
                }))
            }
            Err(why) => Some(Err((self.number, within(why, start)))),
        }
    }
}

/// An object, or which of them is none and why; nothing comes after that.
type Item<'a> = Result<Object<'a>, (u64, Undecodable)>;

impl<'a> Iterator for Objects<'a> {
    type Item = Item<'a>;

    fn next(&mut self) -> Option<Item<'a>> {
        self.number += 1;
        match std::mem::replace(&mut self.rest, Rest::Nothing) {
            Rest::Nothing => None,
            Rest::Broken(why) => Some(Err((self.number, why))),
            Rest::One(bytes) => Some(Ok(Object {
                number: self.number,
                bytes,
            })),
            Rest::Elements(scanner, first) => self.element(scanner, first),
            Rest::Lines(mut rest) => loop {
                if rest.is_empty() {
                    return None;
                }
                let end = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
                let (line, after) = rest.split_at(end);
                rest = after.get(1..).unwrap_or_default();
                if !line.iter().all(u8::is_ascii_whitespace) {
                    self.rest = Rest::Lines(rest);
                    return Some(Ok(Object {
                        number: self.number,
                        bytes: line,
                    }));
                }
                self.number += 1;
            },
        }
    }
}

fn json(body: &[u8]) -> Result<Rest<'_>, Undecodable> {
    let mut scanner = Scanner::new(body)?;
    match scanner.peek() {
        Some(b'[') => {
            scanner.enter();
            Ok(Rest::Elements(scanner, true))
        }
        Some(b'{') => {
            scanner.skip(0)?;
            Ok(match scanner.peek() {
                None => Rest::One(body),
                Some(_) => Rest::Lines(body),
            })
        }
        _ => Err(Undecodable::Json {
            offset: scanner.position() as u64,
            what: "expected an object, or an array of objects",
        }),
    }
}

/// The same, counted from the start of the element it is in.
fn within(why: Undecodable, start: usize) -> Undecodable {
    match why {
        Undecodable::Json { offset, what } => Undecodable::Json {
            offset: offset.saturating_sub(start as u64),
            what,
        },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Numbered<'a> = Result<(u64, &'a str), (u64, Undecodable)>;

    fn of(objects: Objects<'_>) -> Vec<Numbered<'_>> {
        objects
            .map(|item| {
                item.map(|object| {
                    let text = std::str::from_utf8(object.bytes).unwrap_or("no UTF-8");
                    (object.number, text.trim())
                })
            })
            .collect()
    }

    #[test]
    fn a_body_is_one_object_an_array_or_lines() {
        let one = "{\n \"a\": [1, {\"b\": \"]}\"}],\n \"c\": NaN\n}\n";
        assert_eq!(of(Objects::json(one.as_bytes())), [Ok((1, one.trim()))]);
        let array = b" [ {\"a\":1} ,\n{\"b\":\"\\\"],[\"},7,[{}]]\r\n";
        assert_eq!(
            of(Objects::json(array)),
            [
                Ok((1, "{\"a\":1}")),
                Ok((2, "{\"b\":\"\\\"],[\"}")),
                Ok((3, "7")),
                Ok((4, "[{}]"))
            ]
        );
        let lines = b"{\"a\":1}\r\n\n  \n{\"b\":2}\nnonsense";
        let found = [
            Ok((1, "{\"a\":1}")),
            Ok((4, "{\"b\":2}")),
            Ok((5, "nonsense")),
        ];
        assert_eq!(of(Objects::json(lines)), found);
        assert_eq!(of(Objects::lines(lines)), found);
        assert_eq!(
            of(Objects::lines(array)).len(),
            2,
            "an array is a line or two there"
        );
        for nothing in ["", "\n \n"] {
            assert_eq!(of(Objects::lines(nothing.as_bytes())), []);
        }
        assert_eq!(of(Objects::json(b"[]")), []);
    }

    #[test]
    fn what_is_broken_is_said_once_with_its_place_and_ends_it() {
        for (body, number, offset) in [
            ("", 1, 0),
            ("  ", 1, 2),
            ("gyro=1", 1, 0),
            ("{\"a\":1", 1, 6),
            ("{\"a\" 1}", 1, 5),
            ("[{\"a\":1},{\"b\" 2}]", 2, 5),
            ("[{\"a\":1}", 2, 0),
            ("[{\"a\":1}] {}", 2, 2),
        ] {
            let found = of(Objects::json(body.as_bytes()));
            let last = found.last().cloned();
            let Some(Err((at, Undecodable::Json { offset: byte, .. }))) = last else {
                unreachable!("{body}: {found:?}")
            };
            assert_eq!((at, byte), (number, offset), "{body}");
            assert_eq!(found.iter().filter(|f| f.is_err()).count(), 1, "{body}");
        }
    }
}
