//! The body of a page, packed -> its bytes. Pure.
//!
//! Apart from the pages because others wrote the unpackers: none is given more room than the page says it needs, and
//! no page may say more than [`MOST_PAGE`], which is asked before.

use std::io::Read;

/// Bytes of an unpacked page.
pub(super) const MOST_PAGE: usize = 64 << 20;

/// Unpacks `body` to exactly `length` bytes.
///
/// # Errors
/// In words: it cannot be unpacked, or to another length; a codec that is not read.
pub(super) fn unpacked(codec: i64, body: &[u8], length: usize) -> Result<Vec<u8>, String> {
    let bad = |name: &str, why: &dyn std::fmt::Display| format!("{name}: {why}");
    let bytes = match codec {
        0 => body.to_vec(),
        1 => {
            // It says its length first, which is asked before room is made.
            let said = snap::raw::decompress_len(body).map_err(|why| bad("snappy", &why))?;
            if said != length {
                return Err(format!(
                    "snappy: unpacks to {said} bytes, and not to {length}"
                ));
            }
            let mut decoder = snap::raw::Decoder::new();
            decoder
                .decompress_vec(body)
                .map_err(|why| bad("snappy", &why))?
        }
        2 => {
            let mut bytes = Vec::new();
            let mut decoder = flate2::read::MultiGzDecoder::new(body).take(length as u64 + 1);
            decoder
                .read_to_end(&mut bytes)
                .map_err(|why| bad("gzip", &why))?;
            bytes
        }
        6 => zstd::bulk::decompress(body, length).map_err(|why| bad("zstd", &why))?,
        7 => lz4_flex::block::decompress(body, length).map_err(|why| bad("lz4", &why))?,
        3 => return Err("packed with LZO, which is not read".to_owned()),
        4 => return Err("packed with Brotli, which is not read".to_owned()),
        5 => return Err("packed with the old LZ4, which is not read".to_owned()),
        other => return Err(format!("packed with an unknown codec, {other}")),
    };
    match bytes.len() == length {
        true => Ok(bytes),
        false => Err(format!(
            "unpacks to {} bytes, and not to {length}",
            bytes.len()
        )),
    }
}
