//! Beginning of a client -> whether the rest of what it sends is read. Pure.
//!
//! Apart from the lines because it must be judged before there is one: a browser can be made to send a
//! request to any port, and what follows in its body would otherwise be lines like any others.

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
                let blank = bytes.get(..blank).unwrap_or_default();
                let lines = memchr::memchr_iter(b'\n', blank).count() as u64;
                self.refuse_opening(self.framer.ended() + lines + 1, rest);
                false
            }
            _ => true,
        }
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
