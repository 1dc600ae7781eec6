//! Origin of an output, for its reader -> its metadata. I/O: reads the ends
//! of the input.

use super::request::ReplayRequest;
use super::session::Topic;
use crate::error::Result;
use crate::sink::{Provenance, Stream, Target};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use strapd_attitude::worlds::EARTH_RATE;
use strapd_recording::Source;

/// Number of bytes at each end of the input that go into its fingerprint.
const END: u64 = 1 << 20;

/// The metadata of a run's outputs.
///
/// # Errors
/// The input cannot be read again.
pub(super) fn of(run: &ReplayRequest, topics: &[Topic], streams: &[Stream]) -> Result<Provenance> {
    let mut provenance = Provenance::default();
    let mut put = |key: String, value: String| {
        provenance.metadata.insert(key, value);
    };
    put("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
    put("command".to_owned(), run.command.clone());
    let files = match &run.source {
        Source::Parts(paths) => paths.clone(),
        source => vec![source.name()],
    };
    let shown = |path: &PathBuf| match path.file_name() {
        Some(name) if !run.record_paths => name.to_string_lossy().into_owned(),
        _ => path.display().to_string(),
    };
    let names: Vec<String> = files.iter().map(shown).collect();
    put("input".to_owned(), names.join(", "));
    put("method".to_owned(), run.plan.method.to_string());
    // The ends are read only where there is something to write the result into, and never of a
    // pipe: opening it a second time would wait for a second writer.
    if !run.source.files().is_empty()
        && files.iter().all(|path| path.is_file())
        && run.targets.iter().any(|t| *t != Target::Null)
    {
        let prints = files.iter().map(|path| fingerprint(path));
        let prints = prints.collect::<Result<Vec<String>>>()?;
        put("input_fingerprint".to_owned(), prints.join(", "));
    }
    for (topic, stream) in topics.iter().zip(streams) {
        let prepared = &topic.prepared;
        let key = |name: &str| match topics {
            [_] => name.to_owned(),
            _ => format!("{} {name}", stream.output_topic),
        };
        let [w, x, y, z] = prepared.initial.wxyz();
        let [bx, by, bz]: [f64; 3] = prepared.bias.into();
        put(key("topic"), topic.name.clone());
        put(key("output_topic"), stream.output_topic.clone());
        put(key("sample_kind"), topic.resolved.kind.name().to_owned());
        put(key("gyro_unit"), topic.resolved.unit.name().to_owned());
        put(key("input_axes"), topic.resolved.body.to_string());
        if let Some(aiding) = &prepared.aiding {
            put(key("aid"), aiding.name().to_owned());
        }
        put(key("clock"), prepared.clock.name().to_owned());
        put(key("noise"), prepared.noise.name.clone());
        if let Some(words) = prepared.stamps.words(topic.resolved.kind) {
            put(key("stamps"), words);
        }
        put(key("rotates"), stream.rotates.clone());
        put(key("world"), stream.world_axes.clone());
        put(key("body"), stream.body_axes.clone());
        put(
            key("initial"),
            format!("{} (w {w}, x {x}, y {y}, z {z})", prepared.initial_origin),
        );
        if let Some(latitude) = run.plan.latitude_deg {
            put(
                key("earth_rate"),
                format!(
                    "taken out for latitude {} deg, {EARTH_RATE} rad/s; rates stay relative to inertial space",
                    latitude
                ),
            );
        }
        put(
            key("bias_rad_s"),
            format!("{} (x {bx}, y {by}, z {bz})", prepared.bias_origin),
        );
    }
    Ok(provenance)
}

/// SHA-256 of all of a file, hexadecimal.
///
/// # Errors
/// It cannot be read.
pub fn sha256(path: &Path, mut file: impl Read) -> Result<String> {
    let mut offset = 0;
    let fail = |offset, source| strapd_recording::Error::Read {
        path: path.to_owned(),
        offset,
        source,
    };
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 20];
    loop {
        match file.read(&mut block) {
            Ok(0) => return Ok(hexadecimal(&hash.finalize())),
            Ok(n) => {
                offset += n as u64;
                hash.update(block.get(..n).unwrap_or_default());
            }
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(fail(offset, e).into()),
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// `sha256-ends:HEX`: SHA-256 over the length (8 bytes, little endian), the first and the last MiB.
/// It names a log as surely as a hash of all of it would, without reading 10 GB for it.
fn fingerprint(path: &Path) -> Result<String> {
    let fail = |source| strapd_recording::Error::Read {
        path: path.to_owned(),
        offset: 0,
        source,
    };
    let mut file = File::open(path).map_err(fail)?;
    let length = file.metadata().map_err(fail)?.len();
    let mut hash = Sha256::new();
    hash.update(length.to_le_bytes());
    let mut end = Vec::new();
    for start in [0, length.saturating_sub(END)] {
        end.clear();
        file.seek(SeekFrom::Start(start)).map_err(fail)?;
        Read::take(&mut file, END)
            .read_to_end(&mut end)
            .map_err(fail)?;
        hash.update(&end);
    }
    Ok(format!("sha256-ends:{}", hexadecimal(&hash.finalize())))
}
