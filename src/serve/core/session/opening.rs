//! Beginning of a client -> whether the rest of what it sends is read. Pure.
//!
//! Apart from the lines because it must be judged before there is one: a browser can be made to send a
//! request to any port, and what follows in its body would otherwise be lines like any others.

use super::rows::Rows;
use super::{End, Session, first_line_must_be_auth};
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::wire;
use strapd_recording::decode::packed::MARK;

/// Stage of a conversation. Until its first object was seen nothing else is read: what a
/// browser can be made to send (HTTP) begins otherwise, and so is refused before anything of it counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Opening {
    /// Nothing has come, or blanks.
    Blank,
    /// A line has begun as an object, or as a packed one.
    Begun,
    /// A line has begun as text: of a table, or a device that says what it is before its header. Its whole first line
    /// decides.
    Text,
    /// Conversation that was accepted.
    Over,
}

impl Session {
    /// Whether to read what came: not when the conversation begins with anything but an object.
    pub(super) fn begins(&mut self, bytes: &[u8]) -> bool {
        let blank = bytes.iter().take_while(|b| b.is_ascii_whitespace()).count();
        match bytes.get(blank..) {
            Some(rest @ [first, ..]) if self.opening == Opening::Blank => {
                if matches!(first, b'{' | &MARK) {
                    self.opening = Opening::Begun;
                    return true;
                }
                if self.may_begin_table(*first) {
                    self.opening = Opening::Text;
                    return true;
                }
                let blank = bytes.get(..blank).unwrap_or_default();
                let lines = memchr::memchr_iter(b'\n', blank).count() as u64;
                self.refuse_opening(self.framer.ended() + lines + 1, rest);
                false
            }
            _ => true,
        }
    }

    /// Whether a conversation whose first byte is this may be of a table: text, or the mark before it. What a browser can
    /// be made to send is text, too, and is refused by its first line ([`wire::is_request`]).
    fn may_begin_table(&self, first: u8) -> bool {
        const FIRST_OF_MARK: u8 = 0xef;
        let is_text = (b' '..0x7f).contains(&first) || first == FIRST_OF_MARK;
        is_text && first != b'[' && self.authorised && !matches!(self.rows, Rows::Never)
    }

    /// Refuses one that does not begin with an object: nothing of it, and nothing behind it, is read.
    pub(super) fn refuse_opening(&mut self, number: u64, near: &[u8]) {
        let fault = wire::no_object(near, self.hub.takes_samples());
        if !self.authorised {
            let auth = first_line_must_be_auth();
            let message = format!("{}; {}", auth.message, fault.message);
            return self.refuse(&Fault::new(auth.code, message), number);
        }
        self.say(&fault, number, near);
        self.end = Some(End::NoObject);
    }
}
