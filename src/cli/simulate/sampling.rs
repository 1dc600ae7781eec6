//! The flags every motion takes: how it is sampled, where the samples go. Pure.

mod sensor;

use super::{Made, parameter};
use crate::cli::known_words;
use crate::cli::replay::CompressionArg;
use crate::cli::serving::{Played, Served, Serving};
use crate::client::remote::parameters;
use crate::error::{Error, Result};
use crate::pipeline::simulate::Simulation;
use crate::serve::core::reading::LineParameters;
use crate::sink::{Format, FrameNames, Options, Target};
use clap::{Args, ValueEnum};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_bodies::synthetic::{ForceSampling, Synthetic};
use strapd_recording::attitude_line::sensor_of_truth;

/// Gravity where the motion does not say otherwise: standard gravity.
pub(super) const GRAVITY: f64 = 9.80665;

/// Meaning of a reading of the accelerometer.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum ForceArg {
    /// Instant, whatever the gyro's sample is
    Instant,
    /// Same as the gyro: of the instant beside a rate, else the mean over the interval
    AsGyro,
}

impl From<ForceArg> for ForceSampling {
    fn from(arg: ForceArg) -> Self {
        match arg {
            ForceArg::Instant => ForceSampling::Instant,
            ForceArg::AsGyro => ForceSampling::AsGyro,
        }
    }
}

/// Help of `-o`.
fn sinks() -> String {
    let (samples, truth) = Format::endings_for_samples();
    let subject = format!("Output for the samples: {samples} ({truth}: the true attitude alone)");
    crate::cli::sinks(&subject, "", "")
}

/// Settings of sampling a motion, and of the outputs.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Sampling")]
pub struct Common {
    #[arg(
        short,
        long = "output",
        value_name = "SINK",
        required_unless_present = "page",
        help_heading = "Output",
        help = sinks()
    )]
    pub outputs: Vec<String>,
    /// Replace outputs that exist
    #[arg(long, help_heading = "Output")]
    pub force: bool,
    /// Compression of MCAP outputs
    #[arg(long, value_enum, default_value = "zstd", help_heading = "Output")]
    pub compression: CompressionArg,
    /// Speed: max, or a factor of data time such as 1 or 0.5 [default: max; with --page or --paused 1]
    #[arg(
        long,
        value_name = "FACTOR",
        help_heading = "Output",
        value_parser = known_words::speed(),
        hide_possible_values = true
    )]
    pub speed: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub serving: Serving,
    /// Samples a second
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "HZ",
        default_value_t = 2000.0,
        allow_negative_numbers = true
    )]
    pub rate_hz: f64,
    /// Seconds from the first sample to the last
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "SECS",
        default_value_t = 10.0,
        allow_negative_numbers = true
    )]
    pub duration: f64,
    /// Meaning of a sample: the rate at its stamp, the mean over the interval that ends at its stamp, the
    /// integral over it, or the whole rotation in it
    #[arg(long, help_heading = "Sampling", default_value = "rate", value_parser = known_words::sample_kind())]
    pub sample_kind: String,
    /// Position of the accelerometer: from the point whose motion it is, m, body axes (ahead, left, up)
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "X,Y,Z",
        default_value = "0,0,0",
        allow_hyphen_values = true
    )]
    pub lever_arm: String,
    /// Meaning of a reading of the accelerometer [default: as-gyro where the sensor is carried, else instant]
    #[arg(long, help_heading = "Sampling", value_enum)]
    pub force_sampling: Option<ForceArg>,
    /// A magnetometer too, so many readings a second [default: one with every sample]
    #[arg(long, help_heading = "Sampling", value_name = "HZ", num_args = 0..=1, allow_negative_numbers = true)]
    pub mag: Option<Option<f64>>,
    /// The Earth's magnetic field: strength in uT, dip (down is positive) and declination (east is
    /// positive) in degrees; north is the world's y
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "UT,DEG,DEG",
        default_value = "48,60,0",
        allow_hyphen_values = true
    )]
    pub field: String,
    /// Something of iron comes near: FROM,TO in s, and what it adds to the field, uT, east, north, up.
    /// May be given several times
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "FROM,TO,X,Y,Z",
        allow_hyphen_values = true,
        requires = "mag"
    )]
    pub field_disturbance: Vec<String>,
    /// Seed of everything random; the same seed gives the same bytes
    #[arg(long, help_heading = "Sampling", value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Errors of the sensor: none, a preset (consumer_mems, industrial_mems, tactical, navigation, ...; with
    /// accelerometer and magnetometer consumer_imu, industrial_imu, rough_imu), or terms in the units of data sheets:
    /// arw=0.15,bias-instability=0.5,...
    #[arg(
        long,
        value_name = "NOISE",
        default_value = "none",
        value_parser = known_words::noise_of_a_sensor(),
        hide_possible_values = true,
        help_heading = "Errors"
    )]
    pub noise: String,
    /// Samples are taken up to this part of an interval early or late, and the stamps say so
    #[arg(
        long,
        value_name = "PART",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        help_heading = "Errors"
    )]
    pub jitter: f64,
    /// Stamps are wrong by this part of an interval (1 sigma)
    #[arg(
        long,
        value_name = "PART",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        help_heading = "Errors"
    )]
    pub stamp_jitter: f64,
    /// Added to every stamp, seconds
    #[arg(
        long,
        value_name = "SECS",
        default_value = "0",
        allow_hyphen_values = true,
        help_heading = "Errors"
    )]
    pub stamp_offset: String,
    /// The sensor's clock runs fast by this many millionths
    #[arg(
        long,
        value_name = "PPM",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        help_heading = "Errors"
    )]
    pub stamp_drift: f64,
    /// Part of the samples that is lost
    #[arg(
        long,
        value_name = "PART",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        help_heading = "Errors"
    )]
    pub drop: f64,
    /// Mean length of a run of lost samples
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1.0,
        allow_negative_numbers = true,
        help_heading = "Errors"
    )]
    pub burst: f64,
    /// Stamp of the first instant, seconds since 1970 (up to nine decimals)
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "SECS",
        default_value = "1700000000",
        allow_hyphen_values = true
    )]
    pub start_stamp: String,
    /// Id of the sensor in lines, for several in one daemon; that of its truth is `NAME truth`. Of one address
    /// tcp://HOST:PORT?id=NAME [default: imu]
    #[arg(long, value_name = "NAME", help_heading = "Sampling", value_parser = sensor_id)]
    pub id: Option<String>,
    /// frame_id of the sensor
    #[arg(
        long,
        help_heading = "Sampling",
        value_name = "FRAME",
        default_value = "imu_link"
    )]
    pub frame_id: String,
}

impl Common {
    /// The simulation of this motion.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag.
    pub(super) fn simulation(&self, name: &str, made: Made) -> Result<(Simulation, Served)> {
        let sampling = self.sampling(&made)?;
        let kind = sampling.kind;
        let mut parameters = made.parameters;
        parameters.extend(self.parameters(&sampling));
        let source = Synthetic::new(made.motion, sampling)
            .map_err(|e| Error::usage(Diagnostic::from(&e).at(format_args!("simulate {name}"))))?;
        if let Some(sensor) = source.sensor() {
            let bias = sensor.constants().bias;
            if bias.amax() > 0.0 {
                let text = format!("{},{},{}", bias.x, bias.y, bias.z);
                parameters.push(parameter("unit_bias_rad_s", text));
            }
        }
        let (outputs, id) = self.named()?;
        let targets = outputs
            .iter()
            .map(|o| Target::parse(o))
            .collect::<Result<_>>()?;
        let played = Played {
            name: &format!("simulate {name}"),
            can_rewind: true,
            brings_samples: true,
        };
        let served = self.serving.start(
            targets,
            self.speed.as_deref(),
            played,
            &FrameNames::default(),
        )?;
        let simulation = Simulation {
            name: name.to_owned(),
            source,
            kind,
            rate_hz: self.rate_hz,
            frame_id: self.frame_id.clone(),
            id,
            targets: served.targets.clone(),
            audience: served.audience(),
            options: Options {
                force: self.force,
                compression: self.compression.into(),
                ..Options::default()
            },
            speed: served.speed,
            parameters,
            notes: made.notes,
        };
        Ok((simulation, served))
    }
}

/// `--id`.
fn sensor_id(text: &str) -> std::result::Result<String, String> {
    let given = [("id".to_owned(), text.to_owned())];
    let id = LineParameters::parse(&given)?.id.unwrap_or_default();
    match sensor_of_truth(&id) {
        Some(_) => Err("the truth is called so, which is sent beside it".to_owned()),
        None => Ok(id),
    }
}

impl Common {
    /// The outputs without the `?id=NAME` of addresses, and the id that they or the flag give the sensor.
    fn named(&self) -> Result<(Vec<String>, Option<String>)> {
        let mut id = self.id.clone();
        let mut outputs = Vec::new();
        for output in &self.outputs {
            let (address, query) = output.split_once('?').unwrap_or((output, ""));
            let given = parameters(query).unwrap_or_default();
            let value = match &given[..] {
                [(name, value)] if name == "id" && address.starts_with("tcp://") => value,
                _ => {
                    outputs.push(output.clone());
                    continue;
                }
            };
            let refuse = |why: &str| Err(Error::usage(format!("-o {address}?id=..: {why}")));
            match sensor_id(value) {
                Err(why) => return refuse(&why),
                Ok(other) if id.as_ref().is_some_and(|id| *id != other) => {
                    return refuse("one sensor has one id, and another is given, too");
                }
                Ok(name) => id = Some(name),
            }
            outputs.push(address.to_owned());
        }
        Ok((outputs, id))
    }
}
