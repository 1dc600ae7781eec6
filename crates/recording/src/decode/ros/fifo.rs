//! PX4's `sensor_gyro_fifo`, raw counts of up to 32 samples in a message -> samples. Pure.
//!
//! Apart from the plan because its numbers lie axis by axis in arrays that are filled as far as a count says, are to
//! be scaled, and have one stamp: that of the last sample, the others `dt` apart before it.

use super::read::bytes_of;
use crate::decode::schema::{Field, Kind, Many, Number, Schema};
use crate::decode::{Decoded, Undecodable};
use strapd_attitude::record::{Nanos, RawSample};

/// Positions of the fields.
#[derive(Debug, Clone)]
pub(crate) struct Fifo {
    /// `timestamp_sample`, us.
    stamp: usize,
    /// Time between samples, us.
    dt: usize,
    /// rad/s of one count.
    scale: usize,
    /// Number of samples.
    samples: usize,
    /// Counts about x, y, z.
    axes: [usize; 3],
    /// Room for so many.
    most: usize,
    /// Bytes before the fields.
    head: usize,
    /// Bytes of fields.
    size: usize,
}

impl Fifo {
    /// The places of the fields, if all are there; `is_cdr` else packed.
    pub(crate) fn compile(schema: &Schema, is_cdr: bool) -> Option<Fifo> {
        let fields = &schema.get(schema.root)?.fields;
        let mut places = Vec::with_capacity(fields.len());
        let mut at = 0_usize;
        for field in fields {
            let Kind::Number(number) = field.kind else {
                return None;
            };
            let size = number.size() as usize;
            let n = match field.many {
                Many::One => 1,
                Many::Array(n) => n as usize,
                Many::Sequence => return None,
            };
            if is_cdr {
                at = at.checked_next_multiple_of(size)?;
            }
            places.push((field, at));
            at = at.checked_add(size.checked_mul(n)?)?;
        }
        let find = |name: &str, is: &dyn Fn(&Field) -> bool| {
            let found = places.iter().find(|(field, _)| field.name == name);
            found.filter(|(field, _)| is(field)).map(|(_, at)| *at)
        };
        let one = |name: &str, number| {
            find(name, &|field| {
                field.kind == Kind::Number(number) && field.many == Many::One
            })
        };
        let most = places.iter().find_map(|(field, _)| match field.many {
            Many::Array(n) if field.name == "x" => Some(n),
            _ => None,
        })?;
        let axis = |name: &str| {
            let counts = |field: &Field| {
                field.kind == Kind::Number(Number::I16) && field.many == Many::Array(most)
            };
            find(name, &counts)
        };
        Some(Fifo {
            stamp: one("timestamp_sample", Number::U64)?,
            dt: one("dt", Number::F32)?,
            scale: one("scale", Number::F32)?,
            samples: one("samples", Number::U8)?,
            axes: [axis("x")?, axis("y")?, axis("z")?],
            most: most as usize,
            head: if is_cdr { 4 } else { 0 },
            size: at,
        })
    }

    /// The samples of one message.
    pub(crate) fn decode(
        &self,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Decoded, Undecodable> {
        if self.head > 0 && super::encapsulation(payload)? {
            // PX4 runs on little-endian machines alone.
            return Err(Undecodable::Encapsulation {
                found: [0, 0],
                what: "big-endian, which PX4 never is",
            });
        }
        let data = payload.get(self.head..).unwrap_or(&[]);
        let short = || Undecodable::Short {
            have: payload.len() as u64,
            need: self.head.saturating_add(self.size) as u64,
            field: "the samples".to_owned(),
        };
        let data = data.get(..self.size).ok_or_else(short)?;
        let float = |at| {
            bytes_of::<4>(data, at)
                .map(f32::from_le_bytes)
                .map(f64::from)
        };
        let stamp = bytes_of::<8>(data, self.stamp).map(u64::from_le_bytes);
        let (Some(stamp), Some(dt), Some(scale), Some(n)) = (
            stamp,
            float(self.dt),
            float(self.scale),
            data.get(self.samples),
        ) else {
            return Err(short());
        };
        let n = usize::from(*n);
        if n > self.most {
            return Err(Undecodable::TooMany {
                limit: self.most as u64,
                field: "samples".to_owned(),
            });
        }
        let last = i64::try_from(stamp)
            .unwrap_or(i64::MAX)
            .saturating_mul(1000);
        for k in 0..n {
            let count = |axis: &usize| {
                let count = bytes_of::<2>(data, axis + 2 * k).map_or(0, i16::from_le_bytes);
                f64::from(count) * scale
            };
            let [x, y, z] = &self.axes;
            let before = ((n - 1 - k) as f64 * dt * 1e3).round();
            out.push(RawSample {
                header: Some(Nanos(last.saturating_sub(before as i64))),
                log,
                publish,
                gyro: Some([count(x), count(y), count(z)]),
                ..RawSample::default()
            });
        }
        Ok(Decoded {
            samples: n,
            ..Decoded::default()
        })
    }
}
