//! A payload -> the rates and forces of each device in it, in the camera's axes. Pure.
//!
//! Apart from the stamps because it needs nothing but the payload itself.

use super::klv::{Item, Items};

/// Quantity that was measured.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum What {
    /// rad/s.
    Rate,
    /// m/s^2.
    Force,
}

/// The samples of one sensor in one payload.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Stream {
    /// Number of the device.
    pub(super) device: u32,
    pub(super) what: What,
    /// About and along x, y, z.
    pub(super) samples: Vec<[f64; 3]>,
    /// Time of the first, us on the camera's clock.
    pub(super) stamp: Option<u64>,
    /// Axes of its columns, as letters: lower case is reversed.
    pub(super) axes: String,
}

/// Contents of a payload.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Payload {
    pub(super) streams: Vec<Stream>,
    /// Number and name of each device.
    pub(super) devices: Vec<(u32, String)>,
    /// The camera's clock at its beginning, ms.
    pub(super) tick: Option<u64>,
    /// Streams of rates or forces that cannot be read: why.
    pub(super) refused: Vec<&'static str>,
    /// Bytes at its end that are none of it.
    pub(super) rest: usize,
}

/// Most devices, and most samples, of a payload: the fastest camera has a twentieth of these.
const MOST_DEVICES: usize = 64;
const MOST_SAMPLES: usize = 100_000;

/// Axes of the columns where nothing says them: those of the cameras that say none.
const USUAL: &str = "ZXY";

pub(super) fn payload(bytes: &[u8]) -> Payload {
    let mut found = Payload::default();
    let mut items = Items(bytes);
    for item in items.by_ref().filter(|item| item.key == *b"DEVC") {
        if found.devices.len() >= MOST_DEVICES {
            found.refused.push("more devices than a payload may have");
            break;
        }
        device(&item, &mut found);
    }
    // What fills a payload up is no loss.
    found.rest = match items.0.iter().all(|byte| *byte == 0) {
        true => 0,
        false => items.0.len(),
    };
    found
}

fn device(item: &Item<'_>, found: &mut Payload) {
    let mut number = 0;
    let mut name = String::new();
    let mut inner = item.inner();
    let mut streams = Vec::new();
    for item in inner.by_ref() {
        match &item.key {
            b"DVID" => {
                number = item
                    .count()
                    .and_then(|n| u32::try_from(n).ok())
                    .unwrap_or(0)
            }
            b"DVNM" => name = item.text(),
            // A damaged length took in what follows.
            b"DEVC" => found.refused.push("a device within another"),
            b"TICK" => found.tick = found.tick.or(item.count()),
            b"STRM" => streams.push(item),
            _ => {}
        }
    }
    if inner.0.iter().any(|byte| *byte != 0) {
        found
            .refused
            .push("a device ends in bytes that are no item");
    }
    if found.devices.iter().any(|(known, _)| *known == number) {
        return found.refused.push("a device that is there twice");
    }
    for item in streams {
        let have = found.streams.iter().map(|stream| stream.samples.len());
        let left = MOST_SAMPLES.saturating_sub(have.sum());
        match stream(number, &item, left) {
            // The second of a kind is another sensor, of which nothing else is known.
            Ok(Some(new))
                if found
                    .streams
                    .iter()
                    .any(|s| s.device == number && s.what == new.what) =>
            {
                found.refused.push("a second sensor of a device");
            }
            Ok(new) => found.streams.extend(new),
            Err(why) => found.refused.push(why),
        }
    }
    found.devices.push((number, name));
}

/// The samples of a stream, `most` of them; `None` for one of something else.
fn stream(device: u32, item: &Item<'_>, most: usize) -> Result<Option<Stream>, &'static str> {
    let (mut scale, mut stamp, mut unit) = (Vec::new(), None, String::new());
    let (mut letters, mut name) = (String::new(), String::new());
    let mut data = None;
    let mut inner = item.inner();
    for item in inner.by_ref() {
        match &item.key {
            b"SCAL" => scale = item.numbers().collect(),
            b"STMP" => stamp = item.count(),
            b"SIUN" => unit = item.text(),
            b"ORIN" => letters = item.text(),
            b"STNM" => name = item.text(),
            b"GYRO" => data = Some((What::Rate, item)),
            b"ACCL" => data = Some((What::Force, item)),
            _ => {}
        }
    }
    let Some((what, item)) = data else {
        return Ok(None);
    };
    if item.columns() != 3 {
        return Err("rates or forces that are not of three numbers");
    }
    let is_si = match what {
        What::Rate => unit.is_empty() || unit == "rad/s",
        What::Force => unit.is_empty() || unit.starts_with("m/s"),
    };
    if !is_si {
        return Err("rates that are not in rad/s, or forces that are not in m/s^2");
    }
    let axes = axes(&letters, &name);
    let places = places(&axes).ok_or("letters of its axes that are not X, Y and Z")?;
    let divisor = |column: usize| match scale.as_slice() {
        [] => 1.0,
        [one] => *one,
        several => several.get(column).copied().unwrap_or(1.0),
    };
    let divisors = [divisor(0), divisor(1), divisor(2)];
    if divisors.contains(&0.0) {
        return Err("a scale of zero");
    }
    let columns: Vec<_> = divisors.into_iter().zip(places).collect();
    let samples = samples(item.numbers(), &columns, most)?;
    Ok(Some(Stream {
        device,
        what,
        samples,
        stamp,
        axes,
    }))
}

/// Triples of numbers on the camera's axes, `most` of them; each column has its divisor, axis and sign.
fn samples(
    mut numbers: impl Iterator<Item = f64>,
    columns: &[(f64, (usize, f64))],
    most: usize,
) -> Result<Vec<[f64; 3]>, &'static str> {
    let mut samples = Vec::new();
    while let (Some(a), Some(b), Some(c)) = (numbers.next(), numbers.next(), numbers.next()) {
        if samples.len() >= most {
            return Err("more samples than a payload may have");
        }
        let mut sample = [0.0; 3];
        for (value, (divisor, (axis, sign))) in [a, b, c].iter().zip(columns) {
            if let Some(slot) = sample.get_mut(*axis) {
                *slot = sign * value / divisor;
            }
        }
        samples.push(sample);
    }
    Ok(samples)
}

/// The letters of the columns: those of `ORIN`, or those in brackets in the name.
fn axes(letters: &str, name: &str) -> String {
    if !letters.is_empty() {
        return letters.to_owned();
    }
    let inside = name
        .split_once('(')
        .and_then(|(_, rest)| rest.split_once(')'));
    let named: String = inside.map_or("", |(inside, _)| inside).split(',').collect();
    match named.len() == 3 && places(&named.to_uppercase()).is_some() {
        true => named.to_uppercase(),
        false => USUAL.to_owned(),
    }
}

/// Axis and sign of each column.
fn places(letters: &str) -> Option<[(usize, f64); 3]> {
    let place = |letter: u8| {
        let axis = b"XYZ"
            .iter()
            .position(|l| *l == letter.to_ascii_uppercase())?;
        Some((
            axis,
            if letter.is_ascii_uppercase() {
                1.0
            } else {
                -1.0
            },
        ))
    };
    let [a, b, c] = *letters
        .as_bytes()
        .first_chunk()
        .filter(|_| letters.len() == 3)?;
    let places = [place(a)?, place(b)?, place(c)?];
    let has = |axis: usize| places.iter().any(|(found, _)| *found == axis);
    (has(0) && has(1) && has(2)).then_some(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_those_of_the_letters_or_of_the_name_else_those_of_the_first_cameras() {
        assert_eq!(axes("YxZ", "Gyroscope (z,x,y)"), "YxZ");
        assert_eq!(axes("", "Gyroscope (z,x,y)"), "ZXY");
        assert_eq!(axes("", "Gyroscope (x,y,z)"), "XYZ");
        assert_eq!(
            axes("", "Accelerometer (up/down, right/left, forward/back)"),
            "ZXY"
        );
        assert_eq!(places("YxZ"), Some([(1, 1.0), (0, -1.0), (2, 1.0)]));
        for none in ["YYZ", "XY", "XYZX", "ABC"] {
            assert_eq!(places(none), None, "{none}");
        }
    }
}
