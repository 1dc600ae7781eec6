//! LZ4 frame -> bytes, into a buffer that is there already. Pure.
//!
//! A stage of its own because a log's chunk is one frame of linked 64 KiB blocks: decoding the
//! blocks straight into the chunk's buffer, each with the 64 KiB before it as dictionary, saves the
//! copy, the second hash and the allocations of a general frame reader.
//! Layout: LZ4 Frame Format Description 1.6.4 (Y. Collet).

const MAGIC: [u8; 4] = 0x184D_2204_u32.to_le_bytes();
const WINDOW: usize = 64 << 10;
const STORED: u32 = 1 << 31;

/// Unpacks `packed` into `out`; how many bytes there were.
///
/// Checksums inside the frame are stepped over, not checked: only for a chunk whose own CRC is
/// checked afterwards. `None` where the frame is of a kind this does not read (dictionaries, skippable
/// and legacy frames, reserved bits) or is damaged; the general reader then has its say.
pub(super) fn unpack(packed: &[u8], out: &mut [u8]) -> Option<usize> {
    let mut b = crate::records::Bytes::new(packed);
    if b.take(4)? != MAGIC {
        return None;
    }
    let flags = b.u8()?;
    let block_flags = b.u8()?;
    let version = flags >> 6;
    let (reserved, dictionary) = (flags & 0b10, flags & 0b1);
    if version != 1 || reserved != 0 || dictionary != 0 || block_flags & 0b1000_1111 != 0 {
        return None;
    }
    let linked = flags & 0b10_0000 == 0;
    let block_checksums = flags & 0b1_0000 != 0;
    if flags & 0b1000 != 0 {
        b.u64()?; // content size: the chunk header says it, and is checked
    }
    b.u8()?; // header checksum

    let mut done = 0;
    loop {
        let head = b.u32()?;
        if head == 0 {
            break;
        }
        let block = b.take(usize::try_from(head & !STORED).ok()?)?;
        if block_checksums {
            b.u32()?;
        }
        let (before, room) = out.split_at_mut_checked(done)?;
        if head & STORED != 0 {
            room.get_mut(..block.len())?.copy_from_slice(block);
            done += block.len();
        } else if linked && done > 0 {
            let window = before.get(done.saturating_sub(WINDOW)..)?;
            done += lz4_flex::block::decompress_into_with_dict(block, room, window).ok()?;
        } else {
            done += lz4_flex::block::decompress_into(block, room).ok()?;
        }
    }
    if flags & 0b100 != 0 {
        b.u32()?; // content checksum
    }
    b.rest().is_empty().then_some(done)
}

#[cfg(test)]
mod tests;
