//! The table itself, in the order in which rows are applied and help lists them.
//!
//! Long because it is one table: every setting is a row of it, and the order of all rows counts.

use super::{Default, Row, Takes, Word};
use crate::condition::{
    Clock, GyroUnit, LONGEST_SECS, MAX_GAP_SECS, OnGap, SAMPLE_RATES, SpikePolicy, StampRepair,
};
use crate::diagnostic::Diagnostic;
use crate::estimate::noise_presets::NOISE_PRESETS;
use crate::estimate::plan::{
    Aid, Bias, CLASS_BY_DATA, EstimationSettings, Initial, LONGEST_DELAY, NO_NOISE, Noise,
    Truncation,
};
use crate::frames::BodyAxes;
use crate::propagate::{Method, Order};
use crate::quaternion::BodyRate;
use crate::record::SampleKind;
use crate::setting::*;
use crate::worlds::World;

const fn word(name: &'static str, meaning: &'static str, set: fn(&mut EstimationSettings)) -> Word {
    Word {
        name,
        also: &[],
        meaning,
        set,
    }
}

impl Word {
    /// The same with other spellings.
    const fn or(mut self, also: &'static [&'static str]) -> Word {
        self.also = also;
        self
    }
}

/// A number without words before it.
const fn number(
    unit: &'static str,
    least: f64,
    most: f64,
    set: fn(&mut EstimationSettings, f64),
) -> Takes {
    Takes::Number {
        before: "",
        unit,
        range: (least, most),
        set,
    }
}

/// Fields that most rows leave out.
const ROW: Row = Row {
    setting: TIME,
    meaning: "",
    effect: "",
    default: Default::Unset(""),
    environment: None,
    placeholder: "",
    words: &[],
    takes: Takes::Words,
    needs: |_| Ok(()),
};

/// Every setting of an estimation.
// A row is read as one; broken at 100 columns it is a page.
#[rustfmt::skip]
pub static ROWS: [Row; 38] = [
    Row {
        setting: TIME,
        meaning: "Clock on which the samples are placed; `index` needs {rate_hz}",
        effect: "Every interval is the step between two stamps of this clock. `log` helps where the stamps inside the messages are zero, stand still or jump; it has the jitter of the way to the recorder.",
        default: Default::Value("header"),
        environment: Some("STRAPD_TIME"),
        placeholder: "TIME",
        words: &[
            word(Clock::Header.name(), "The stamp inside the message", |p| p.clock = Clock::Header),
            word(Clock::Log.name(), "Time at which it was recorded", |p| p.clock = Clock::Log),
            word(Clock::Publish.name(), "Time at which it was sent", |p| p.clock = Clock::Publish),
            // Without a rate, which the next row sets and `EstimationSettings::check` asks for.
            word(Clock::Index { rate_hz: 0.0 }.name(), "Number of the sample divided by {rate_hz}", |p| p.clock = Clock::Index { rate_hz: f64::NAN }),
        ],
        ..ROW
    },
    Row {
        setting: RATE_HZ,
        meaning: "Sample rate for {time} index",
        default: Default::Unset("the stamps tell"),
        placeholder: "HZ",
        takes: number("Hz", SAMPLE_RATES.0, SAMPLE_RATES.1, |p, rate_hz| p.clock = Clock::Index { rate_hz }),
        needs: |p| match p.clock {
            Clock::Index { .. } => Ok(()),
            _ => Err(Diagnostic::new(format!("{RATE_HZ}: only {TIME} index uses it"))
                .help(format!("{TIME} index {RATE_HZ} HZ"))),
        },
        ..ROW
    },
    Row {
        setting: STAMPS,
        meaning: "Stamps that are not those of an even clock: auto (mended where the data prove it), as-recorded",
        effect: "auto: stamps go on where a counter wraps, and where their clock was set while the recorder's went on; batches that were stamped when they came are spread evenly (files); rows that are alike on a clock coarser than the sensor are no repeats; a clock that stands still, or by which gravity does not, gives way to the log time. What is done is reported; other recordings are the same with both.",
        default: Default::Value("auto"),
        environment: Some("STRAPD_STAMPS"),
        placeholder: "STAMPS",
        words: &[
            word(StampRepair::Auto.name(), "Mended where the data prove what happened", |p| p.stamps = StampRepair::Auto),
            word(StampRepair::AsRecorded.name(), "As they are", |p| p.stamps = StampRepair::AsRecorded),
        ],
        ..ROW
    },
    Row {
        setting: METHOD,
        meaning: "Method by which rates become rotations. `commit` is that of `serve`: it waits for no later sample, nor for one that was overtaken",
        effect: "`auto` is the most accurate for a recording. The methods after `commit` are there for comparison.",
        default: Default::Value("auto"),
        environment: Some("STRAPD_METHOD"),
        placeholder: "METHOD",
        words: &[
            word("auto", "Centred windows of 16 rates or 15 increments, exact", |p| p.method = Method::Auto),
            word("magnus", "A polynomial through a window of samples, integrated in closed form", |p| p.method = Method::MAGNUS),
            word("causal", "The same through the samples so far: 5 of them, order 6", |p| p.method = Method::CAUSAL),
            word("commit", "Without latency, and with the drift of centred windows", |p| p.method = Method::COMMIT),
            word("dcm-left", "The rate at the start of each interval, held", |p| p.method = Method::DcmLeft),
            word("dcm-right", "The rate at its end, held", |p| p.method = Method::DcmRight),
            word("dcm-mean", "The mean of both", |p| p.method = Method::DcmMean),
            word("rotvec-sum", "One rotation by the sum of all rotation vectors", |p| p.method = Method::RotvecSum),
            word("coning2", "Coning-optimised blocks of 2 increments", |p| p.method = Method::Coning2),
            word("coning3", "Coning-optimised blocks of 3 increments", |p| p.method = Method::Coning3),
            word("coning4", "Coning-optimised blocks of 4 increments", |p| p.method = Method::Coning4),
            word("rk4", "Runge-Kutta on the quaternion, the rate linear over the interval", |p| p.method = Method::Rk4),
        ],
        ..ROW
    },
    Row {
        setting: WINDOW,
        meaning: "Samples in the window of {method} magnus|causal|commit (2 to 24; commit: 6 rates or 5 increments)",
        effect: "A longer window follows smooth motion better, and noise and gaps worse.",
        default: Default::Unset("that of the method: 16, 5 (causal), 6 rates or 5 increments (commit)"),
        placeholder: "P",
        takes: Takes::Count(set_window),
        needs: has_window,
        ..ROW
    },
    Row {
        setting: ORDER,
        meaning: "Order of the Magnus step of {method} magnus|causal|commit",
        effect: "Order to which the non-commutativity of rotation is kept over one interval; a lower one is faster.",
        default: Default::Unset("that of the method: exact, 6 (causal), 8 (commit)"),
        placeholder: "ORDER",
        words: &[
            word(Order::M2.name(), "The delta angle as rotation vector; local error of order 3 in the interval", |p| set_order(p, Order::M2)),
            word(Order::M4.name(), "One cross product; order 5", |p| set_order(p, Order::M4)),
            word(Order::M6.name(), "Order 7", |p| set_order(p, Order::M6)),
            word(Order::M8.name(), "Order 9", |p| set_order(p, Order::M8)),
            word(Order::Exact.name(), "Order 9 where its error is beneath notice, else to the last bit", |p| set_order(p, Order::Exact)),
        ],
        needs: has_window,
        ..ROW
    },
    Row {
        setting: SAMPLE_KIND,
        meaning: "Meaning of a sample in time",
        effect: "It matters more than the order of the method: a mean taken for a rate is half an interval late.",
        default: Default::Unset("as the recording or its format states; else by an orientation in the samples (files); else average where the ordinary step is at most 20 ms, and rate above"),
        environment: Some("STRAPD_SAMPLE_KIND"),
        placeholder: "SAMPLE_KIND",
        words: &[
            word(SampleKind::Rate.name(), "Instantaneous rate at the stamp", |p| p.kind = Some(SampleKind::Rate)),
            word(SampleKind::Average.name(), "Mean rate over the interval ending at the stamp", |p| p.kind = Some(SampleKind::Average)),
            word(SampleKind::DeltaAngle.name(), "Integral of the rate over it", |p| p.kind = Some(SampleKind::DeltaAngle)),
            word(SampleKind::Rotation.name(), "Rotation vector of the whole rotation in it, coning included", |p| p.kind = Some(SampleKind::Rotation)),
        ],
        ..ROW
    },
    Row {
        setting: AID,
        meaning: "Measurements that correct the attitude: auto (gravity where the samples carry a specific force), none (the gyro alone), gravity, gravity+mag",
        effect: "By gravity the attitude is level from the first sample, its tilt does not drift, and the gyro's bias, scale and misalignment are learned; the heading stays the gyro's. By gravity+mag the heading is that of the magnetic field.",
        default: Default::Value("auto"),
        environment: Some("STRAPD_AID"),
        placeholder: "AID",
        words: &[
            word("auto", "The accelerometer, where the samples carry a specific force", |p| p.aid = Aid::Auto),
            word("none", "The gyro alone", |p| p.aid = Aid::None),
            word("gravity", "The accelerometer", |p| p.aid = Aid::Gravity),
            word("gravity+mag", "The accelerometer and a magnetometer", |p| p.aid = Aid::GravityAndField),
        ],
        ..ROW
    },
    Row {
        setting: SMOOTH,
        meaning: "Smooth: the best attitude the whole recording can give, all of it at the end, with the sensor calibrated from the recording itself (needs the accelerometer; {aid} gravity+mag: heading from north)",
        default: Default::Unset("off"),
        takes: Takes::Switch(|p, on| p.smooth = on),
        ..ROW
    },
    Row {
        setting: LINEAR_ACCELERATION,
        meaning: "Give the acceleration without gravity beside each attitude, m/s^2, with its sigma (needs an accelerometer)",
        effect: "The accelerometer's bias is taken out as far as it is known. It is the acceleration of the place where the sensor sits.",
        default: Default::Unset("off"),
        takes: Takes::Switch(|p, on| p.linear_acceleration = on),
        ..ROW
    },
    Row {
        setting: ACCEL_SIGN,
        meaning: "Reading of the accelerometer at rest: specific force (up, as most do) or kinematic acceleration (down)",
        effect: "The data cannot show it: with the wrong one the attitude is upside down.",
        default: Default::Value("specific"),
        placeholder: "ACCEL_SIGN",
        words: &[
            word("specific", "Up at rest", |p| p.is_accel_kinematic = false),
            word("kinematic", "Down at rest", |p| p.is_accel_kinematic = true),
        ],
        ..ROW
    },
    Row {
        setting: MAG_MOUNT,
        meaning: "Rotation from the magnetometer's to body axes, as {mount}",
        default: Default::Unset("as the gyro's"),
        placeholder: "q=W,X,Y,Z",
        takes: Takes::Mounting(|p, q_bs| p.mag_mount = Some(q_bs)),
        ..ROW
    },
    Row {
        setting: MAG_HARD_IRON,
        meaning: "Learn the magnetometer's hard iron, known at the start to this share of the field (1 sigma: 0.03 to 0.1)",
        effect: "For a magnetometer that nobody has calibrated, on a body that rotates about every axis; elsewhere it costs accuracy. 0: there is none.",
        default: Default::Value("0"),
        placeholder: "SIGMA",
        takes: number("of the field", 0.0, 1.0, |p, share| p.mag_hard_iron = share),
        ..ROW
    },
    Row {
        setting: DECLINATION,
        meaning: "Declination: how far magnetic north lies east of true north, in degrees",
        effect: "The heading by {aid} gravity+mag is true then; without it, it is magnetic.",
        default: Default::Value("0"),
        placeholder: "DEG",
        takes: number("degrees", -180.0, 180.0, |p, degrees| p.declination = degrees.to_radians()),
        ..ROW
    },
    Row {
        setting: UNDO_TRUNCATION,
        meaning: "Put back what a driver cut from the rates towards zero, half a step: auto (a file shows it), on, on=STEP in rad/s, off",
        effect: "Of rates that were cut the bias at rest is wrong in motion, by up to half a step.",
        default: Default::Unset("auto where the attitude is aided, else off"),
        environment: Some("STRAPD_UNDO_TRUNCATION"),
        placeholder: "WHEN",
        words: &[
            word("auto", "Where the data of a file show it", |p| p.truncation = Truncation::Auto),
            word("on", "In the steps that the data show", |p| p.truncation = Truncation::On),
            word("off", "Rates stay as they are", |p| p.truncation = Truncation::Off),
        ],
        takes: Takes::Number {
            before: "on=",
            unit: "rad/s",
            range: (0.0, 1.0),
            set: |p, step| p.truncation = Truncation::Steps(step),
        },
        ..ROW
    },
    Row {
        setting: SENSOR_DELAY,
        meaning: "Delay of the sensor's own filters, in seconds",
        effect: "Each attitude is rotated on by its rate for so long: at 10 rad/s, 2 ms are 1.1 degrees.",
        default: Default::Value("0"),
        placeholder: "SECS",
        takes: number("s", -LONGEST_DELAY, LONGEST_DELAY, |p, secs| p.sensor_delay_secs = secs),
        ..ROW
    },
    Row {
        setting: GYRO_UNIT,
        meaning: "Unit of the recorded rates",
        default: Default::Unset("rad, unless the format says otherwise"),
        environment: Some("STRAPD_GYRO_UNIT"),
        placeholder: "GYRO_UNIT",
        words: &[
            word(GyroUnit::Rad.name(), "rad/s", |p| p.unit = Some(GyroUnit::Rad)).or(&["rad/s"]),
            word(GyroUnit::Deg.name(), "deg/s", |p| p.unit = Some(GyroUnit::Deg)).or(&["deg/s", "dps"]),
            word(GyroUnit::Mrad.name(), "mrad/s", |p| p.unit = Some(GyroUnit::Mrad)).or(&["mrad/s"]),
        ],
        ..ROW
    },
    Row {
        setting: GYRO_AXES,
        meaning: "Axes of the gyro alone, as a signed map before {body}: which recorded axis is x, y, z of the sensor (lower case = reversed)",
        effect: "For a gyro whose axes are exchanged or reversed against the accelerometer's, which {body} cannot correct, since it relabels both. A map that mirrors, as `xYZ`, is taken.",
        default: Default::Value("XYZ"),
        placeholder: "MAP",
        takes: Takes::Text {
            what: "a map such as YxZ",
            set: |p, text| {
                p.gyro_axes = text.parse().map_err(|e| Diagnostic::from(&e))?;
                Ok(())
            },
        },
        ..ROW
    },
    Row {
        setting: GYRO_SCALE,
        meaning: "Factor of the recorded rates: one, or x,y,z for the recorded axes, before {gyro_axes}",
        effect: "For rates in counts, or read with the wrong range: 0.0010642 makes rad/s of the counts of a sensor with 16.4 of them per deg/s. {gyro_unit} is applied as well.",
        default: Default::Value("1"),
        placeholder: "FACTOR",
        takes: Takes::Factors(|p, factors| p.gyro_scale = factors),
        ..ROW
    },
    Row {
        setting: ACCEL_AXES,
        meaning: "Axes of the accelerometer alone, as {gyro_axes}",
        default: Default::Value("XYZ"),
        placeholder: "MAP",
        takes: Takes::Text {
            what: "a map such as YxZ",
            set: |p, text| {
                p.accel_axes = text.parse().map_err(|e| Diagnostic::from(&e))?;
                Ok(())
            },
        },
        ..ROW
    },
    Row {
        setting: ACCEL_SCALE,
        meaning: "Factor of the recorded specific forces: one, or x,y,z for the recorded axes, before {accel_axes}",
        effect: "For forces in counts: 0.0047884 makes m/s^2 of the counts of a sensor with 2048 of them per g.",
        default: Default::Value("1"),
        placeholder: "FACTOR",
        takes: Takes::Factors(|p, factors| p.accel_scale = factors),
        ..ROW
    },
    Row {
        setting: MAG_AXES,
        meaning: "Axes of the magnetometer alone, as {gyro_axes}, before {mag_mount} or {body}",
        effect: "For a magnetometer whose axes are not those of its board, as the AK8963's in an MPU-9250: `YXz`.",
        default: Default::Value("XYZ"),
        placeholder: "MAP",
        takes: Takes::Text {
            what: "a map such as YxZ",
            set: |p, text| {
                p.mag_axes = text.parse().map_err(|e| Diagnostic::from(&e))?;
                Ok(())
            },
        },
        ..ROW
    },
    Row {
        setting: BODY,
        meaning: "Axes of the input: flu, frd, or a map such as YxZ (which sensor axis is x, y, z of the body; lower case = reversed)",
        default: Default::Unset("flu, unless the format says otherwise"),
        environment: Some("STRAPD_BODY"),
        placeholder: "AXES",
        words: &[
            word("flu", "x forward, y left, z up", |p| p.body = Some(BodyAxes::Flu)),
            word("frd", "x forward, y right, z down", |p| p.body = Some(BodyAxes::Frd)),
        ],
        takes: Takes::Text {
            what: "a map such as YxZ",
            set: |p, text| {
                p.body = Some(text.parse().map_err(|e| Diagnostic::from(&e))?);
                Ok(())
            },
        },
        ..ROW
    },
    Row {
        setting: WORLD,
        meaning: "World of the output: the axes against which the attitude is given",
        effect: "With {aid} gravity it is `level` unless another is given, with gravity+mag `enu`.",
        default: Default::Value("start"),
        environment: Some("STRAPD_WORLD"),
        placeholder: "WORLD",
        words: &[
            word(World::Start.name(), "The attitude at the first sample", |p| p.world = World::Start),
            word(World::Level.name(), "z up, heading of the start", |p| p.world = World::Level),
            word(World::Enu.name(), "x east, y north, z up", |p| p.world = World::Enu),
            word(World::Ned.name(), "x north, y east, z down, with a body forward, right, down", |p| p.world = World::Ned),
            word(World::Nwu.name(), "x north, y west, z up", |p| p.world = World::Nwu),
        ],
        ..ROW
    },
    Row {
        setting: MOUNT,
        meaning: "Rotation from sensor to body axes, C_bs: q=w,x,y,z, or rpy=roll,pitch,yaw of the sensor in body axes, in degrees",
        default: Default::Unset("none"),
        placeholder: "q=W,X,Y,Z",
        takes: Takes::Mounting(|p, q_bs| p.mount = Some(q_bs)),
        ..ROW
    },
    Row {
        setting: INIT,
        meaning: "Initial attitude: identity, gravity (level from the accelerometer at rest), first-orientation, q=w,x,y,z, or rpy=roll,pitch,yaw in degrees",
        effect: "With {aid} gravity roll and pitch are level anyway, and this sets the heading.",
        default: Default::Value("identity"),
        placeholder: "INIT",
        words: &[
            word("identity", "Body axes are the world's at the first sample", |p| p.initial = Initial::Identity),
            word("gravity", "Roll and pitch from the accelerometer at rest, yaw 0", |p| p.initial = Initial::Gravity),
            word("first-orientation", "The first recorded orientation", |p| p.initial = Initial::FirstOrientation),
        ],
        takes: Takes::Attitude(|p, q_nb| p.initial = Initial::Given(q_nb)),
        ..ROW
    },
    Row {
        setting: BIAS,
        meaning: "Gyro bias in rad/s, body axes: none, auto (from detected rest), or x,y,z",
        effect: "It is subtracted from every rate. An uncorrected bias makes the attitude of the gyro alone drift at its own rate.",
        default: Default::Unset("auto in a file whose attitude is aided, if it rests, else none"),
        placeholder: "BIAS",
        words: &[
            word("none", "Nothing is subtracted", |p| p.bias = Bias::None),
            word("auto", "Estimated from detected rest; refused where there is none", |p| p.bias = Bias::Auto),
        ],
        takes: Takes::Rate(|p, bias| p.bias = Bias::Given(BodyRate(bias.into()))),
        ..ROW
    },
    Row {
        setting: CALIBRATION,
        meaning: "Calibration of the sensor: a TOML file, as `replay` and `calibrate` save it. serve: or a folder of such files, each for the sensor it names",
        effect: "It is taken out first, and its sigmas are where the filter begins.",
        default: Default::Unset("none"),
        placeholder: "FILE",
        takes: Takes::Calibration(|p, known| p.calibration = Some(known)),
        ..ROW
    },
    Row {
        setting: MAX_GAP,
        meaning: "Longest gap that is bridged, in seconds",
        effect: "The rotation over a bridged gap is interpolated; at a longer one {on_gap} holds.",
        default: Default::Value("0.5"),
        placeholder: "SECS",
        takes: number("s", 0.0, MAX_GAP_SECS, |p, secs| p.max_gap_secs = secs),
        ..ROW
    },
    Row {
        setting: ON_GAP,
        meaning: "Beyond {max_gap}: hold the attitude, bridge all the same, or reset to the initial attitude",
        default: Default::Value("hold"),
        placeholder: "ON_GAP",
        words: &[
            word(OnGap::Hold.name(), "Keep the attitude", |p| p.on_gap = OnGap::Hold),
            word(OnGap::Bridge.name(), "Interpolate all the same", |p| p.on_gap = OnGap::Bridge),
            word(OnGap::Reset.name(), "Go back to the initial attitude", |p| p.on_gap = OnGap::Reset),
        ],
        ..ROW
    },
    Row {
        setting: EARTH_RATE,
        meaning: "Take out the Earth's rotation at a fixed site, exactly: its latitude in degrees, north positive. Needs {world} enu, ned or nwu and a known heading",
        effect: "Without it the gyro reads 15 deg/h of the Earth, which drifts as a bias does.",
        default: Default::Unset("the Earth's rotation is left in"),
        placeholder: "LAT_DEG",
        takes: number("degrees", -90.0, 90.0, |p, latitude| p.latitude_deg = Some(latitude)),
        ..ROW
    },
    Row {
        setting: REGULARISE_STAMPS,
        meaning: "Replace stamps that jitter by evenly spaced ones: a straight line through the stamps of each stretch of constant rate (a stream: a causal tracker). Only for a sensor that samples evenly",
        default: Default::Unset("off"),
        takes: Takes::Switch(|p, on| p.regularise_stamps = on),
        ..ROW
    },
    Row {
        setting: MEND,
        meaning: "Apply to a recording what is certain: the axes or the scale of a sensor that contradict the others, where the cure was tried on the whole recording and leaves no contradiction",
        effect: "Unset, the finding names the settings and nothing is changed. What was applied is in the summary (`mended`). The recording is read up to four times more; of several sensors, and of a stream, nothing is changed.",
        default: Default::Unset("findings advise, nothing is changed"),
        takes: Takes::Switch(|p, on| p.mend = on),
        ..ROW
    },
    Row {
        setting: GYRO_RANGE,
        meaning: "Full scale of the gyro in rad/s: samples at or beyond it are marked saturated",
        effect: "Rotation that the gyro clips is lost: saturated samples are counted and shown, and sigma grows about the axis that was clipped.",
        default: Default::Unset("the level at which an axis is seen to be clipped"),
        placeholder: "RAD_S",
        takes: number("rad/s", 0.0, f64::INFINITY, |p, range| p.gyro_range = Some(range)),
        ..ROW
    },
    Row {
        setting: SPIKES,
        meaning: "Spikes: one to three samples far off the line between their neighbours, which nothing else felt: repair (the gyro's by that line; without those of the accelerometer), keep",
        effect: "A spike that is integrated rotates the attitude forever: one of 30 rad/s at 100 Hz by 17 degrees. Each that is repaired is counted and shown. A live stream and {method} commit wait for no later sample: there the attitude goes back to where it would be without the spike, one to four samples later (of the first samples sixteen), and that sample is marked `repaired`.",
        default: Default::Value(SpikePolicy::Repair.name()),
        placeholder: "SPIKES",
        words: &[
            word(SpikePolicy::Repair.name(), "Replace them by the line between their neighbours", |p| p.spikes = SpikePolicy::Repair),
            word(SpikePolicy::Keep.name(), "Leave them as recorded", |p| p.spikes = SpikePolicy::Keep),
        ],
        ..ROW
    },
    Row {
        setting: NOISE,
        meaning: "Class of the sensor: auto, consumer, uncalibrated, industrial, tactical, navigation, none, or a list",
        effect: "It says how sure the attitude is (sigma), and what the filter expects of the sensor. auto is consumer; of a file whose attitude gravity corrects, uncalibrated where its data clearly tell that nobody calibrated the sensor. A list is in the units of data sheets, as in simulate: arw (deg/sqrt(h)) and any of bias-instability (deg/h), rrw (deg/h/sqrt(h)), turn-on-bias (deg/h) and initial (deg), with commas between: arw=0.15,bias-instability=2; each one number, or three x/y/z for the body axes. The turn-on bias counts unless a bias is removed ({bias}); initial is the uncertainty of the initial attitude. And one number each: scale-ppm and misalignment (deg), which grow with the angle of rotation, tilt (deg) of {init} gravity.",
        default: Default::Value(CLASS_BY_DATA),
        placeholder: "NOISE",
        words: &[
            word(CLASS_BY_DATA, "By the data of a file, else consumer", |p| p.noise = Noise::by_data()),
            word(NOISE_PRESETS[0].name, "A chip of consumer electronics, calibrated by its maker", |p| p.noise = Noise::preset(&NOISE_PRESETS[0])),
            word(NOISE_PRESETS[1].name, "A cheap chip on a board that nobody has measured", |p| p.noise = Noise::preset(&NOISE_PRESETS[1])),
            word(NOISE_PRESETS[2].name, "A calibrated module, 2 deg/h", |p| p.noise = Noise::preset(&NOISE_PRESETS[2])),
            word(NOISE_PRESETS[3].name, "0.5 deg/h", |p| p.noise = Noise::preset(&NOISE_PRESETS[3])),
            word(NOISE_PRESETS[4].name, "0.01 deg/h", |p| p.noise = Noise::preset(&NOISE_PRESETS[4])),
            word(NO_NOISE, "Nothing is stated, and no covariance carried (zeros): faster, of a gyro alone", |p| p.noise = Noise::none()),
        ],
        takes: Takes::Figures(|p, noise| p.noise = noise),
        ..ROW
    },
    Row {
        setting: START,
        meaning: "Skip the first seconds of the data",
        default: Default::Unset("the first sample"),
        placeholder: "SECS",
        takes: number("s", -LONGEST_SECS, LONGEST_SECS, |p, secs| p.start = Some(secs)),
        ..ROW
    },
    Row {
        setting: UNTIL,
        meaning: "Stop after this many seconds of the data",
        default: Default::Unset("the last sample"),
        placeholder: "SECS",
        takes: number("s", 0.0, LONGEST_SECS, |p, secs| p.until = Some(secs)),
        ..ROW
    },
];

fn has_window(plan: &EstimationSettings) -> Result<(), Diagnostic> {
    match plan.method {
        Method::Magnus { .. } | Method::CommitProvisional { .. } | Method::Live { .. } => Ok(()),
        other => Err(format!(
            "{WINDOW} and {ORDER} belong to {METHOD} magnus, causal or commit, not to {}",
            other.name()
        )
        .into()),
    }
}

fn set_window(plan: &mut EstimationSettings, samples: usize) {
    match &mut plan.method {
        Method::Magnus { window, .. } | Method::CommitProvisional { window, .. } => {
            *window = samples;
        }
        Method::Live { order, finals } => {
            plan.method = Method::CommitProvisional {
                window: samples,
                order: *order,
                finals: *finals,
            };
        }
        _ => {}
    }
}

fn set_order(plan: &mut EstimationSettings, given: Order) {
    if let Method::Magnus { order, .. }
    | Method::CommitProvisional { order, .. }
    | Method::Live { order, .. } = &mut plan.method
    {
        *order = given;
    }
}
