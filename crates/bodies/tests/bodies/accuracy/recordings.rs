//! Bursts cut out of recordings nobody here made. The bridge was tuned on BROAD 01, 03, 05, 09, 11, 15, the minute of
//! 07, Husky and x-IMU3; what is held here, and stands in docs/accuracy.md, is of the others.

use super::bursts::{Bridged, undamaged};
use super::commit;
use super::run::sample;
use crate::shared_data::shared;
use strapd_attitude::propagate::{Method, Noise};
use strapd_attitude::record::{RateSample, SampleKind};

const LOGS: [&str; 9] = [
    "broad/21_undisturbed_fast_combined",
    "broad/25_disturbed_tapping_B",
    "broad/27_disturbed_phone_vibration_B",
    "broad/29_disturbed_stationary_magnet_B",
    "broad/31_disturbed_stationary_magnet_D",
    "broad/33_disturbed_attached_magnet_2cm",
    "broad/35_disturbed_attached_magnet_4cm",
    "real/xsens_mti_ros2_none",
    "real/xio_fusion_ros2_lz4",
];
/// Samples of each that are used: a minute of most.
const MOST: usize = 18_000;

/// Stamps and body rates of the log's `sensor_msgs/msg/Imu`, in order.
fn rates(name: &str) -> Option<Vec<(i64, [f64; 3])>> {
    let bytes = std::fs::read(shared(&format!("logs/{name}.mcap"))?).unwrap();
    let mut samples: Vec<(i64, [f64; 3])> = vec![];
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        if schema.name != "sensor_msgs/msg/Imu" {
            continue;
        }
        let data = &message.data;
        let u32_at = |at: usize| u32::from_le_bytes(data[at..at + 4].try_into().unwrap());
        let base = 4 + (12 + u32_at(12) as usize).div_ceil(8) * 8 + 104;
        let gyro = std::array::from_fn(|i| {
            let at = base + 8 * i;
            f64::from_le_bytes(data[at..at + 8].try_into().unwrap())
        });
        let stamp = i64::from(u32_at(4)) * 1_000_000_000 + i64::from(u32_at(8));
        if samples.last().is_none_or(|last| last.0 < stamp) {
            samples.push((stamp, gyro));
        }
        if samples.len() == MOST {
            break;
        }
    }
    Some(samples)
}

/// Samples of a kind, and which of them follow the one before by an ordinary step.
fn as_kind(rates: &[(i64, [f64; 3])], kind: SampleKind) -> (Vec<RateSample>, Vec<bool>) {
    let mut steps: Vec<i64> = rates.windows(2).map(|p| p[1].0 - p[0].0).collect();
    steps.sort_unstable();
    let ordinary = steps[steps.len() / 2];
    let mut before = rates[0].0 - ordinary;
    rates
        .iter()
        .map(|&(stamp, w)| {
            let step = stamp - before;
            before = stamp;
            // A mean covers its own interval and no longer one.
            let own = step.min(ordinary * 3 / 2);
            let made = match kind {
                SampleKind::Rate => sample(stamp, stamp, w),
                _ => sample(stamp - own, stamp, w.map(|w| w * own as f64 * 1e-9)),
            };
            (made, step > ordinary / 2 && step < ordinary * 5 / 4)
        })
        .unzip()
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn bursts_cut_out_of_recordings_are_bridged_better_than_straight_and_sigma_says_how_well() {
    for (method, kind) in [
        (Method::Auto, SampleKind::Rate),
        (Method::Auto, SampleKind::DeltaAngle),
        (commit(6), SampleKind::Rate),
    ] {
        println!("{method} {kind:?}");
        for missing in [1, 2, 4, 8, 12, 20, 50] {
            // Logarithms of: error, 95 % error, that of a straight line, ratio to sigma.
            let mut sums = [0.0; 5];
            let mut logs = 0;
            for name in LOGS {
                let Some(rates) = rates(name) else { return };
                let (samples, whole) = as_kind(&rates, kind);
                let cut = |method| {
                    let reference = undamaged(&samples, method, kind);
                    let as_told = (method, kind, Noise::default());
                    Bridged::cut(&samples, &reference, missing, as_told, |i| whole[i])
                };
                let bridged = cut(method);
                let straight = cut(Method::DcmMean);
                if bridged.errors.len() < 10 {
                    continue;
                }
                logs += 1;
                let row = [
                    bridged.error(0.5),
                    bridged.error(0.95),
                    straight.error(0.5),
                    bridged.ratio(0.5),
                    bridged.ratio(0.95),
                ];
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += value.ln();
                }
            }
            let [error, most, straight, ratio, tail] =
                sums.map(|sum: f64| (sum / f64::from(logs)).exp());
            println!(
                "{missing}: {error:.1e} {most:.1e} degrees, straight {straight:.1e}, over sigma {ratio:.2} {tail:.2}"
            );
            // Of a normal error 0.89 and 1.61: within a factor of two of that.
            assert!((0.44..1.78).contains(&ratio) && tail < 3.2);
            // Over one or two samples there is little to gain, and over fifty nothing is known that a
            // straight line would not say.
            let least = if (4..=20).contains(&missing) {
                0.9
            } else {
                1.15
            };
            assert!(error < least * straight);
        }
    }
}
