//! Arguments as text -> values, parsed once and validated once. Pure.

pub mod calibration;

use crate::error::{Error, Result};
use std::fmt::Display;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::settings::with;
use strapd_attitude::estimate::{Aid, EstimationSettings, Initial, Noise};
use strapd_attitude::setting::{ACCEL_TOPIC, AID, FIELD, INIT, MAG_TOPIC, NOISE, SHARD};
use strapd_recording::decode::{self, FieldPath, FieldRole};
use strapd_recording::{Selection, TopicBeside};

/// Noise by a class, or by figures in the units of data sheets, as setting `noise` takes it.
///
/// # Errors
/// [`Error::Usage`] naming the part that is wrong.
pub fn parse_noise(text: &str) -> Result<Noise> {
    Ok(with(NOISE, text).map_err(Error::usage)?.noise)
}

/// Initial attitude, as setting `init` takes it.
///
/// # Errors
/// [`Error::Usage`] for anything else, a quaternion that is not near unit norm included.
pub fn parse_initial(text: &str) -> Result<Initial> {
    Ok(with(INIT, text).map_err(Error::usage)?.initial)
}

/// Takes the specific force, and the field, from topics of their own, which a plan without them has no use for.
///
/// # Errors
/// [`Error::Usage`] naming the topic and the aid that uses it.
pub fn take_beside(
    plan: &mut EstimationSettings,
    [accel, mag]: [Option<&String>; 2],
) -> Result<()> {
    plan.has_forces_beside = accel.is_some();
    for (topic, is_unused, aid) in [
        (
            ACCEL_TOPIC,
            accel.is_some() && plan.aid == Aid::None,
            "gravity",
        ),
        (
            MAG_TOPIC,
            mag.is_some() && plan.aid != Aid::GravityAndField,
            "gravity+mag",
        ),
    ] {
        if is_unused {
            let what = format!("{topic}: nothing is taken from it with this {AID}");
            return Err(Error::usage(
                Diagnostic::new(what).help(AID.to(aid).to_string()),
            ));
        }
    }
    Ok(())
}

/// `--topic`, `--field` and `--ignore-covariance-flag`, as given; `--accel-topic` and `--mag-topic` (`beside`),
/// to which the fields of their roles belong.
///
/// # Errors
/// [`Error::Usage`] for a field that is none.
pub fn selection(
    topic: Option<&String>,
    fields: &[String],
    ignore_covariance_flag: bool,
    beside: [Option<&String>; 2],
) -> Result<Selection> {
    let mut fields: Vec<FieldPath> = fields
        .iter()
        .map(|f| f.parse().map_err(|e| Error::usage(format!("{FIELD}: {e}"))))
        .collect::<Result<_>>()?;
    let mut of = |role: FieldRole, topic: Option<&String>| {
        let topic = topic?.clone();
        let fields = fields.extract_if(.., |field| field.role == role).collect();
        Some(TopicBeside { topic, fields })
    };
    let [accel, mag] = beside;
    let (accel, mag) = (of(FieldRole::Accel, accel), of(FieldRole::Mag, mag));
    Ok(Selection {
        accel,
        mag,
        topic: topic.cloned(),
        decode: decode::Options {
            fields,
            ignore_covariance_flag,
            ..decode::Options::default()
        },
    })
}

/// `--shard i/n`: this process takes inputs i, i + n, i + 2n, ... of the list, i from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shard {
    /// Index of the share, from 0.
    pub index: usize,
    /// Number of shares.
    pub of: usize,
}

impl Shard {
    /// `i/n` with `0 <= i < n`.
    ///
    /// # Errors
    /// [`Error::Usage`] otherwise.
    pub fn parse(text: &str) -> Result<Shard> {
        text.split_once('/')
            .and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)))
            .filter(|(i, n)| i < n)
            .map(|(index, of)| Shard { index, of })
            .ok_or_else(|| {
                Error::usage(format!(
                    "{SHARD} {text}: expected i/n with 0 <= i < n, for example {SHARD} 0/4"
                ))
            })
    }

    /// Whether the input at `position` of the list is this share's.
    #[must_use]
    pub fn takes(self, position: usize) -> bool {
        position % self.of == self.index
    }
}

/// `N` finite numbers separated by commas.
pub fn numbers<const N: usize>(what: impl Display, list: &str) -> Result<[f64; N]> {
    let parsed: Option<Vec<f64>> = list
        .split(',')
        .map(|part| part.trim().parse::<f64>().ok().filter(|v| v.is_finite()))
        .collect();
    parsed
        .and_then(|v| <[f64; N]>::try_from(v).ok())
        .ok_or_else(|| {
            Error::usage(format!(
                "{what} {list}: expected {N} finite numbers separated by commas"
            ))
        })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use strapd_attitude::propagate;
    use strapd_attitude::quaternion::Quaternion;

    const DEG: f64 = std::f64::consts::PI / 180.0;

    #[test]
    fn a_preset_is_in_radians_and_seconds() {
        // 0.84 deg/sqrt(h) = 0.014 deg/sqrt(s); 5 deg/h.
        let noise = parse_noise("consumer").unwrap();
        assert!((noise.arw[0] - 0.014 * DEG).abs() < 1e-15);
        assert!((noise.bias_instability[2] - 5.0 * DEG / 3600.0).abs() < 1e-18);
    }

    #[test]
    fn given_noise_needs_its_angle_random_walk() {
        let noise = parse_noise("arw=0.6/1.2/1.8,bias-instability=7200").unwrap();
        // 0.6 deg/sqrt(h) is 0.01 deg/sqrt(s); 7200 deg/h is 2 deg/s.
        for (arw, deg) in noise.arw.into_iter().zip([0.01_f64, 0.02, 0.03]) {
            assert!((arw - deg.to_radians()).abs() < 1e-15, "{arw}");
        }
        for bias in noise.bias_instability {
            assert!((bias - 2.0_f64.to_radians()).abs() < 1e-14, "{bias}");
        }
        for bad in [
            "arw=1/2",
            "arw=1/2/3/4",
            "arw=1//2",
            "arw=1e-4,arw=1e-4",
            "arw=1e-4,",
            "consumer,arw=1",
            "",
            "bias-instability=1e-5",
            "arw=-1",
            "arw=NaN",
            "arw=1e-4,x=2",
            "arw=1e-4,scale=1/2/3",
        ] {
            assert!(parse_noise(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn every_figure_of_noise_reaches_the_propagator() {
        let noise = parse_noise(
            "arw=1,rrw=2,turn-on-bias=3/0/0,bias-instability=4,initial=5/6/7,scale-ppm=250,misalignment=0.5,tilt=1",
        );
        let noise = noise.unwrap();
        let of_deg_per_h = |axes: [f64; 3]| axes.map(|v: f64| (v / 3600.0).to_radians());
        // Independent of each other: 1.7 B of flicker, and what an estimate leaves of the turn-on bias.
        let left = 6.8_f64.hypot(0.09);
        assert_near(noise.unstable_bias(), of_deg_per_h([left, 6.8, 6.8]));
        let both = 3.0_f64.hypot(left);
        assert_near(noise.unremoved_bias(), of_deg_per_h([both, 6.8, 6.8]));
        let propagate::Noise {
            initial,
            arw,
            bias,
            rrw,
            scale,
            misalignment,
            bias_tau,
        } = noise.with_bias([8.0; 3]);
        assert_near(initial, [5.0, 6.0, 7.0].map(f64::to_radians));
        assert_near(arw, [(1.0_f64 / 60.0).to_radians(); 3]);
        assert_eq!(bias, [8.0; 3]);
        assert_near(rrw, of_deg_per_h([2.0 / 60.0; 3]));
        assert_near(
            [scale, misalignment, noise.tilt],
            [250e-6, 0.5_f64.to_radians(), 1.0_f64.to_radians()],
        );
        assert_eq!(bias_tau, None);
    }

    fn assert_near(is: [f64; 3], should: [f64; 3]) {
        for (a, b) in is.into_iter().zip(should) {
            assert!(
                (a - b).abs() <= 1e-14 * b.abs(),
                "{is:?} and not {should:?}"
            );
        }
    }

    #[test]
    fn a_quaternion_that_is_no_rotation_is_refused() {
        assert!(matches!(
            parse_initial("q=1,0,0,0"),
            Ok(Initial::Given(q)) if q == Quaternion::identity()
        ));
        for bad in ["q=1,1,1,1", "q=0,0,0,0", "q=1,0,0", "q=NaN,0,0,1", "qq", ""] {
            assert!(parse_initial(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn shards_share_the_list_without_overlap() {
        let shards: Vec<Shard> = (0..3)
            .map(|i| Shard::parse(&format!("{i}/3")).unwrap())
            .collect();
        for position in 0..20 {
            assert_eq!(shards.iter().filter(|s| s.takes(position)).count(), 1);
        }
        for bad in ["3/3", "0/0", "1", "-1/2", "a/b"] {
            assert!(Shard::parse(bad).is_err(), "{bad}");
        }
    }
}
