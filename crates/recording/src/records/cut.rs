//! Beginning of some bytes -> whether a frame lies there, and how long it is. Pure.
//!
//! Apart from the protocols because all of them answer the same question, and whoever walks over bytes knows no more.

/// Verdict on the bytes at a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Cut {
    /// A whole frame whose checksum holds, or, where the protocol has none, whose form does.
    Frame {
        /// Bytes of it.
        total: usize,
        /// Whether it tells the protocol: it holds what only this one has.
        tells: bool,
    },
    /// Beginning of a frame; so many bytes are needed to say more.
    Need(usize),
    /// Bytes that begin no frame.
    No,
}

impl Cut {
    /// A frame that tells its protocol.
    pub(crate) fn whole(total: usize) -> Cut {
        Cut::Frame { total, tells: true }
    }

    /// Verdict of a checksum about a frame of so many bytes.
    pub(crate) fn checked(holds: bool, total: usize) -> Cut {
        if holds { Cut::whole(total) } else { Cut::No }
    }
}
