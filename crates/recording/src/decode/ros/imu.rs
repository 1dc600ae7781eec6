//! The one layout that nearly every log has, `sensor_msgs/Imu`, without the plan. Pure.
//!
//! Chosen by the layout, not by the type's name: a plan that equals the plan of the built-in
//! definition. Whatever is irregular about a payload gives `None`, and the plan explains it.

use super::Program;
use super::compile::{Layout, samples};
use crate::decode::Decoded;
use crate::decode::registers::{Form, is_mark};
use crate::decode::schema::{builtin, rosmsg::Dialect};
use crate::decode::select::select;
use crate::records::imu;
use strapd_attitude::record::{Nanos, RawSample};

/// Bytes behind the header.
const BODY: usize = imu::NUMBERS * 8;

/// Whether `plan` reads an Imu, everything of it, and nothing else.
pub(crate) fn is_imu(plan: &Program) -> bool {
    let (layout, dialect) = if plan.cdr {
        (Layout::Cdr, Dialect::Ros2)
    } else {
        (Layout::Ros1, Dialect::Ros1)
    };
    let name = "sensor_msgs/Imu";
    let own = builtin::schema(name, dialect).and_then(|schema| {
        let selection = select(&schema, name, &crate::decode::Options::default()).ok()?;
        samples(&schema, &selection, None, layout).ok()
    });
    own.is_some_and(|own| {
        let form = Form {
            ignore_covariance_flag: plan.form.ignore_covariance_flag,
            ..own.form
        };
        (own.ops.as_slice(), own.reads.as_slice(), form, false)
            == (&plan.ops, &plan.reads, plan.form, plan.open)
    })
}

/// The sample of a regular CDR payload.
#[inline]
pub(crate) fn cdr(
    payload: &[u8],
    form: &Form,
    log: Nanos,
    publish: Nanos,
    outcome: &mut Decoded,
) -> Option<RawSample> {
    let (encapsulation, data) = payload.split_first_chunk::<4>()?;
    match encapsulation {
        [0, 1, ..] => sample::<false>(data, 0, 8, form, log, publish, outcome),
        [0, 0, ..] => sample::<true>(data, 0, 8, form, log, publish, outcome),
        _ => None,
    }
}

/// The sample of a regular ROS 1 payload: a sequence number first, no alignment.
#[inline]
pub(crate) fn ros1(
    payload: &[u8],
    form: &Form,
    log: Nanos,
    publish: Nanos,
    outcome: &mut Decoded,
) -> Option<RawSample> {
    sample::<false>(payload, 4, 1, form, log, publish, outcome)
}

/// Returns the covariance of the orientation in a regular payload, row by row.
pub(crate) fn orientation_covariance(payload: &[u8], is_cdr: bool) -> Option<[f64; 9]> {
    fn of<const BIG: bool>(data: &[u8], head: usize, align: usize) -> Option<[f64; 9]> {
        let body = Body::<BIG>::of(data, head, align)?;
        Some(std::array::from_fn(|n| {
            body.double(imu::ORIENTATION_COVARIANCE + n)
        }))
    }
    match payload.split_first_chunk::<4>() {
        Some(([0, 1, ..], data)) if is_cdr => of::<false>(data, 0, 8),
        Some(([0, 0, ..], data)) if is_cdr => of::<true>(data, 0, 8),
        _ if is_cdr => None,
        _ => of::<false>(payload, 4, 1),
    }
}

/// A payload that is all there: seconds, nanoseconds and the length of the frame's name, and the doubles behind it.
struct Body<'a, const BIG: bool> {
    header: &'a [u8; 12],
    doubles: &'a [u8; BODY],
}

impl<'a, const BIG: bool> Body<'a, BIG> {
    #[inline]
    fn of(data: &'a [u8], head: usize, align: usize) -> Option<Self> {
        let header = data.get(head..)?.first_chunk()?;
        let start = (head + 12)
            .checked_add(word::<BIG>(header, 8) as usize)?
            .next_multiple_of(align);
        let (doubles, rest) = data.get(start..)?.split_first_chunk::<BODY>()?;
        (rest.len() <= super::MAX_PADDING).then_some(Body { header, doubles })
    }

    #[inline]
    fn double(&self, n: usize) -> f64 {
        let bytes = std::array::from_fn(|byte| self.doubles[8 * n + byte]);
        if BIG {
            f64::from_be_bytes(bytes)
        } else {
            f64::from_le_bytes(bytes)
        }
    }
}

#[inline]
fn word<const BIG: bool>(header: &[u8; 12], at: usize) -> u32 {
    let bytes = [header[at], header[at + 1], header[at + 2], header[at + 3]];
    if BIG {
        u32::from_be_bytes(bytes)
    } else {
        u32::from_le_bytes(bytes)
    }
}

#[inline]
fn sample<const BIG: bool>(
    data: &[u8],
    head: usize,
    align: usize,
    form: &Form,
    log: Nanos,
    publish: Nanos,
    outcome: &mut Decoded,
) -> Option<RawSample> {
    let body = Body::<BIG>::of(data, head, align)?;
    let double = |n: usize| body.double(n);
    // ROS 1 seconds are unsigned, ROS 2 seconds signed.
    let sec = match (word::<BIG>(body.header, 0), align) {
        (sec, 1) => i64::from(sec),
        (sec, _) => i64::from(sec as i32),
    };
    let nanosec = word::<BIG>(body.header, 4);
    outcome.stamps_carried += usize::from(nanosec >= 1_000_000_000);
    outcome.samples = 1;
    let [x, y, z, w] = std::array::from_fn(|n| double(imu::ORIENTATION + n));
    let accel_is_absent = is_mark(double(imu::FORCE_COVARIANCE)) && !form.ignore_covariance_flag;
    Some(RawSample {
        header: Some(Nanos::from_sec_nanosec(sec, nanosec)),
        log,
        publish,
        gyro: form.gyro(
            std::array::from_fn(|n| double(imu::RATE + n)),
            is_mark(double(imu::RATE_COVARIANCE)),
            outcome,
        ),
        accel: (!accel_is_absent).then(|| std::array::from_fn(|n| double(imu::FORCE + n))),
        mag: None,
        orientation: form.orientation([w, x, y, z], is_mark(double(imu::ORIENTATION_COVARIANCE))),
        orientation_resets: None,
        interval_nanos: None,
        temperature: None,
        is_beside: false,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::decode::Options;
    use proptest::prelude::*;

    /// The plan of the built-in Imu, with and without the short way.
    fn plans(layout: Layout, dialect: Dialect, ignore: bool) -> [Program; 2] {
        let schema = builtin::schema("sensor_msgs/Imu", dialect).unwrap();
        let options = Options {
            ignore_covariance_flag: ignore,
            ..Options::default()
        };
        let selection = select(&schema, "sensor_msgs/Imu", &options).unwrap();
        let long = samples(&schema, &selection, None, layout).unwrap();
        let short = long.clone().recognised();
        assert!(short.imu && !long.imu);
        [short, long]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn the_short_way_and_the_plan_read_the_same_from_any_bytes(
            cdr: bool,
            big: bool,
            ignore: bool,
            frame in 0_u32..12,
            marks in proptest::collection::vec(0_usize..37, 0..4),
            mut body in proptest::collection::vec(any::<u64>(), 37),
            extra in -3_i32..12,
            nanosec: u32,
        ) {
            // -1 where a mark may stand, arbitrary bits (NaN, infinite, huge) elsewhere.
            for mark in marks {
                body[mark] = (-1.0_f64).to_bits();
            }
            let word = |v: u32| if big && cdr { v.to_be_bytes() } else { v.to_le_bytes() };
            let mut payload = if cdr { vec![0, u8::from(!big), 0, 0] } else { vec![1, 0, 0, 0] };
            for v in [0x8765_4321, nanosec, frame] {
                payload.extend(word(v));
            }
            payload.extend(vec![b'f'; frame as usize]);
            if cdr {
                payload.resize((payload.len() - 4).next_multiple_of(8) + 4, 0);
            }
            for v in &body {
                payload.extend(if big && cdr { v.to_be_bytes() } else { v.to_le_bytes() });
            }
            payload.resize((payload.len() as i32 + extra) as usize, 0);
            let (layout, dialect) = if cdr { (Layout::Cdr, Dialect::Ros2) } else { (Layout::Ros1, Dialect::Ros1) };
            let read = plans(layout, dialect, ignore).map(|plan| {
                let mut out = Vec::new();
                let outcome = plan.decode(&plan.form, &payload, Nanos(1), Nanos(2), &mut out);
                // As text, because NaN differs from itself.
                format!("{outcome:?} {out:?}")
            });
            prop_assert_eq!(&read[0], &read[1]);
            let covariance = orientation_covariance(&payload, cdr);
            let bits = covariance.map(|rows| rows.map(f64::to_bits).to_vec());
            let is_whole = (0..=crate::decode::ros::MAX_PADDING as i32).contains(&extra);
            prop_assert_eq!(bits, is_whole.then(|| body[4..13].to_vec()));
        }
    }

    #[test]
    fn another_layout_takes_the_long_way() {
        let text = "std_msgs/Header header\nfloat64[3] angular_velocity\nfloat64 x";
        let schema =
            crate::decode::schema::rosmsg::parse(text, "sensor_msgs/Imu", Dialect::Ros2).unwrap();
        let selection = select(&schema, "sensor_msgs/Imu", &Options::default()).unwrap();
        assert!(
            samples(&schema, &selection, None, Layout::Cdr).is_err(),
            "std_msgs/Header is not defined"
        );
        let text = "builtin_interfaces/Time stamp\nstring frame_id\nfloat64[3] angular_velocity";
        let schema =
            crate::decode::schema::rosmsg::parse(text, "sensor_msgs/Imu", Dialect::Ros2).unwrap();
        let selection = select(&schema, "sensor_msgs/Imu", &Options::default()).unwrap();
        assert!(
            !samples(&schema, &selection, None, Layout::Cdr)
                .unwrap()
                .recognised()
                .imu
        );
    }
}
