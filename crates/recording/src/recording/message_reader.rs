//! Bytes of a message of ROS -> its fields, for whoever knows which come. Pure.
//!
//! Apart from the decoders because these are compiled for samples, of which there are millions; what is read here comes
//! seldom, and for its own sake: the stamp of a picture, the frames of a robot.

use strapd_attitude::record::Nanos;

/// Longest name that is kept, bytes.
const LONGEST_NAME: usize = 4096;

/// Fields of a message, one after the other.
pub(super) struct MessageReader<'a> {
    data: &'a [u8],
    at: usize,
    is_little: bool,
    is_cdr: bool,
}

impl<'a> MessageReader<'a> {
    fn cdr(data: &'a [u8]) -> Option<MessageReader<'a>> {
        let (head, data) = data.split_at_checked(4)?;
        Some(MessageReader {
            data,
            at: 0,
            is_little: head.get(1)? & 1 == 1,
            is_cdr: true,
        })
    }

    /// Begins a payload of this encoding; `None` where it is none of ROS.
    pub(super) fn of(encoding: &str, data: &'a [u8]) -> Option<MessageReader<'a>> {
        match encoding {
            "cdr" => MessageReader::cdr(data),
            "ros1" => Some(MessageReader::ros1(data)),
            _ => None,
        }
    }

    /// Begins a payload of ROS 1.
    pub(super) fn ros1(data: &'a [u8]) -> MessageReader<'a> {
        MessageReader {
            data,
            at: 0,
            is_little: true,
            is_cdr: false,
        }
    }

    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        if self.is_cdr {
            self.at = self.at.checked_next_multiple_of(N)?;
        }
        let bytes = *self.data.get(self.at..)?.first_chunk::<N>()?;
        self.at += N;
        Some(bytes)
    }

    pub(super) fn word(&mut self) -> Option<u32> {
        let bytes = self.bytes::<4>()?;
        Some(match self.is_little {
            true => u32::from_le_bytes(bytes),
            false => u32::from_be_bytes(bytes),
        })
    }

    pub(super) fn number(&mut self) -> Option<f64> {
        let bytes = self.bytes::<8>()?;
        Some(match self.is_little {
            true => f64::from_le_bytes(bytes),
            false => f64::from_be_bytes(bytes),
        })
    }

    pub(super) fn text(&mut self) -> Option<String> {
        let length = self.word()? as usize;
        let bytes = self.data.get(self.at..)?.get(..length)?;
        self.at += length;
        let text = String::from_utf8_lossy(bytes.get(..length.min(LONGEST_NAME))?);
        Some(text.trim_end_matches('\0').to_owned())
    }

    /// Stamp at the beginning of a `std_msgs/Header`; the name of its frame stands behind it.
    pub(super) fn stamp(&mut self) -> Option<Nanos> {
        if !self.is_cdr {
            // A sequence number stands before it.
            self.word()?;
        }
        let (sec, nanosec) = (self.word()?, self.word()?);
        let sec = match self.is_cdr {
            // ROS 2 has a signed one.
            true => i64::from(sec as i32),
            false => i64::from(sec),
        };
        Some(Nanos::from_sec_nanosec(sec, nanosec))
    }
}
