//! Promise: tables of text are read whoever wrote them, what they mean is said, and what cannot be told is refused
//! with the flag that tells it.
//!
//! The files are written here, after their makers' documentation; real ones are read in `tests/commands/tables.rs`.

mod bad_tables;
mod increments;
mod phones;

use std::fmt::Write;
use std::io::Read;
use std::path::Path;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::{AccelUnit, Nanos, RawSample};
use strapd_recording::decode::{Class, Options};
use strapd_recording::format::Format;
use strapd_recording::lines::Lines;

const START: i64 = 1_700_000_000_000_000_000;
const STEP: i64 = 10_000_000;
const ROWS: usize = 60;

/// Contents of a table.
#[derive(Debug, PartialEq, Default)]
pub struct Given {
    pub samples: Vec<RawSample>,
    /// Lines that are no rows, and why.
    pub bad: Vec<(u64, String)>,
    pub assumed: String,
    pub notes: Vec<String>,
    pub gyro: Option<GyroUnit>,
    pub accel: Option<AccelUnit>,
}

/// Gives few bytes at a time.
pub struct Dribble<'b>(pub &'b [u8], pub usize);

impl Read for Dribble<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = self.1.min(into.len()).min(self.0.len());
        into[..n].copy_from_slice(&self.0[..n]);
        self.0 = &self.0[n..];
        Ok(n)
    }
}

pub fn options(columns: &str) -> Options {
    Options {
        columns: (!columns.is_empty()).then(|| columns.parse().unwrap()),
        ..Options::default()
    }
}

pub fn read(name: &str, input: impl Read, options: &Options) -> Result<Given, String> {
    let lines = Lines::new(Path::new(name), Format::Table, input, options);
    let mut lines = lines.map_err(|why| why.to_string())?;
    let table = lines.table().unwrap();
    let mut given = Given {
        assumed: table.assumed().to_owned(),
        notes: table.notes().to_vec(),
        gyro: table.declared().gyro_unit,
        accel: table.declared().accel_unit,
        ..Given::default()
    };
    while let Some(line) = lines.next(&mut given.samples).unwrap() {
        match line {
            Ok(line) => assert!(line.decoded.samples == 1 || matches!(line.class, Class::Other(_))),
            Err(why) => given.bad.push((lines.number(), why.to_string())),
        }
    }
    Ok(given)
}

/// Rate in rad/s, force in m/s^2, field in uT of a row.
fn motion(k: usize) -> [[f64; 3]; 3] {
    let t = k as f64 * 0.01;
    [
        [
            (1.7 * t + 0.3).sin(),
            1.3 * (0.9 * t).cos(),
            0.4 + 0.7 * (3.1 * t).sin(),
        ],
        [0.1 * (2.0 * t).sin(), 0.2, 9.8],
        [20.0 + t, -3.0, -40.0],
    ]
}

/// A vector of a row.
type OfRow = fn(usize) -> [f64; 3];

/// A maker's table: its name, its text, and what is in it.
pub struct Made {
    pub name: &'static str,
    pub text: String,
    /// Nanoseconds of each row.
    stamp: fn(usize) -> i64,
    gyro: fn(usize) -> [f64; 3],
    gyro_unit: Option<GyroUnit>,
    accel: Option<(OfRow, Option<AccelUnit>)>,
    mag: Option<fn(usize) -> [f64; 3]>,
    orientation: Option<[f64; 4]>,
}

fn table(name: &'static str, head: &str, end: &str, row: impl Fn(usize) -> String) -> Made {
    let mut text = head.to_owned();
    for k in 0..ROWS {
        write!(text, "{}{end}", row(k)).unwrap();
    }
    Made {
        name,
        text,
        stamp: |k| k as i64 * STEP,
        gyro: |k| motion(k)[0],
        gyro_unit: Some(GyroUnit::Rad),
        accel: None,
        mag: None,
        orientation: None,
    }
}

fn joined(separator: &str, numbers: impl IntoIterator<Item = f64>) -> String {
    let each: Vec<String> = numbers.into_iter().map(|n| format!("{n:?}")).collect();
    each.join(separator)
}

/// Hundredths of a second, written as seconds.
fn secs(k: usize) -> String {
    format!("{}.{:02}", k / 100, k % 100)
}

const SI: Option<AccelUnit> = Some(AccelUnit::MetresPerSecondSquared);
const G: Option<AccelUnit> = Some(AccelUnit::StandardGravity);

pub fn all() -> Vec<Made> {
    let force: fn(usize) -> [f64; 3] = |k| motion(k)[1];
    let field: fn(usize) -> [f64; 3] = |k| motion(k)[2];
    let microtesla: fn(usize) -> [f64; 3] = |k| motion(k)[2].map(|v| v * 1e-6);
    let degrees: fn(usize) -> [f64; 3] = |k| motion(k)[0];
    vec![
        Made {
            stamp: |k| START + k as i64 * 5_000_000,
            accel: Some((force, SI)),
            ..table(
                "data.csv",
                "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\r\n",
                "\r\n",
                |k| {
                    let [w, a, _] = motion(k);
                    format!(
                        "{},{}",
                        START + k as i64 * 5_000_000,
                        joined(",", w.into_iter().chain(a))
                    )
                },
            )
        },
        Made {
            stamp: |k| START + k as i64 * STEP,
            ..table("Gyroscope.csv", "time,seconds_elapsed,z,y,x\n", "\n", |k| {
                let [x, y, z] = motion(k)[0];
                format!("{},{},{z:?},{y:?},{x:?}", START + k as i64 * STEP, secs(k))
            })
        },
        table(
            "phyphox.csv",
            "\"Time (s)\";\"Gyroscope x (rad/s)\";\"Gyroscope y (rad/s)\";\"Gyroscope z (rad/s)\";\"Absolute (rad/s)\"\n",
            "\n",
            |k| {
                let numbers = motion(k)[0].map(|v| format!("{v:e}").replace('e', "E"));
                format!("{}E0;{};1,0E0", secs(k), numbers.join(";")).replace('.', ",")
            },
        ),
        table(
            "phyphox tabs.csv",
            "\"Time (s)\"\t\"Gyroscope x (rad/s)\"\t\"Gyroscope y (rad/s)\"\t\"Gyroscope z (rad/s)\"\t\"Absolute (rad/s)\"\n",
            "\n",
            |k| format!("{}\t{}\t1.0", secs(k), joined("\t", motion(k)[0])),
        ),
        Made {
            accel: Some((force, G)),
            mag: Some(microtesla),
            ..table(
                "physics toolbox.csv",
                "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz,Bx,By,Bz\n",
                "\n",
                |k| {
                    let [w, a, m] = motion(k);
                    let numbers = a.into_iter().chain([0.0; 3]).chain(w).chain(m);
                    format!("{},{}", secs(k), joined(",", numbers))
                },
            )
        },
        Made {
            // A counter of 16 bits that wraps, and a stamp that is there in name alone.
            stamp: |k| (65_500 + k as i64) * STEP,
            accel: Some((force, SI)),
            orientation: Some([
                std::f64::consts::FRAC_1_SQRT_2,
                0.0,
                0.0,
                std::f64::consts::FRAC_1_SQRT_2,
            ]),
            ..table(
                "MT_0001.txt",
                "// General information:\r\n// Update Rate: 100.0Hz\r\n// Filter Profile: human (46.1)\r\nPacketCounter\tSampleTimeFine\tYear\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tMat[1][1]\tMat[2][1]\tMat[3][1]\tMat[1][2]\tMat[2][2]\tMat[3][2]\tMat[1][3]\tMat[2][3]\tMat[3][3]\r\n",
                "\t\r\n",
                |k| {
                    let [w, a, _] = motion(k);
                    // A quarter turn to the left: x to y. Columns of the matrix, one after the other.
                    let matrix = [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
                    let numbers = a.into_iter().chain(w).chain(matrix);
                    format!(
                        "{:05}\t\t\t{}",
                        (65_500 + k) % 65_536,
                        joined("\t", numbers)
                    )
                },
            )
        },
        Made {
            stamp: |k| (4_294_900_000 + k as i64 * 16_667) * 1000,
            gyro: degrees,
            gyro_unit: Some(GyroUnit::Deg),
            accel: Some((force, SI)),
            mag: Some(field),
            orientation: Some([1.0, 0.0, 0.0, 0.0]),
            ..table(
                "dot.csv",
                "sep=,\nDeviceTag:,Movella DOT 1\nFirmwareVersion:,1.6.0\nOutputRate:,60Hz\n\nPacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z,Mag_X,Mag_Y,Mag_Z,Status\n",
                "\n",
                |k| {
                    let [w, a, m] = motion(k);
                    let numbers = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
                        .into_iter()
                        .chain(a)
                        .chain(w)
                        .chain(m);
                    let fine = (4_294_900_000 + k as u64 * 16_667) % (1 << 32);
                    format!("{k},{fine},{},0", joined(",", numbers))
                },
            )
        },
        Made {
            stamp: |k| (392_093_562 + k as i64 * 20_034) * 1000,
            gyro_unit: Some(GyroUnit::Deg),
            accel: Some((force, G)),
            ..table(
                "Inertial.csv",
                "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n",
                "\n",
                |k| {
                    let [w, a, _] = motion(k);
                    format!(
                        "{},{}",
                        392_093_562 + k * 20_034,
                        joined(",", w.into_iter().chain(a))
                    )
                },
            )
        },
        Made {
            gyro: |k| motion(k)[0].map(|v| (v * 500.0).round() * 0.001_221_730_47),
            accel: Some((
                |k| motion(k)[1].map(|v| (v * 100.0).round() * 0.000_488_281_25),
                G,
            )),
            ..table(
                "camera.gcsv",
                "GYROFLOW IMU LOG\nversion,1.3\nid,made_here\norientation,YxZ\nnote,a, b, c\ntscale,0.001\ngscale,0.00122173047\nascale,0.00048828125\nt,gx,gy,gz,ax,ay,az\n",
                "\n",
                |k| {
                    let [w, a, _] = motion(k);
                    let numbers = w.map(|v| v * 500.0).into_iter().chain(a.map(|v| v * 100.0));
                    let numbers: Vec<String> = numbers.map(|v| format!("{}", v.round())).collect();
                    format!("{},{}", k * 10, numbers.join(","))
                },
            )
        },
        Made {
            stamp: |k| START + k as i64 * STEP,
            gyro_unit: Some(GyroUnit::Deg),
            accel: Some((force, SI)),
            mag: Some(|k| motion(k)[2].map(|v| v * 1e-4)),
            ..table(
                "shimmer.csv",
                "\"sep=\t\"\nShimmer_B663_Timestamp_Unix_CAL\tShimmer_B663_Accel_LN_X_CAL\tShimmer_B663_Accel_LN_Y_CAL\tShimmer_B663_Accel_LN_Z_CAL\tShimmer_B663_Gyro_X_CAL\tShimmer_B663_Gyro_Y_CAL\tShimmer_B663_Gyro_Z_CAL\tShimmer_B663_Mag_X_CAL\tShimmer_B663_Mag_Y_CAL\tShimmer_B663_Mag_Z_CAL\t\nms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s\tlocal_flux\tlocal_flux\tlocal_flux\t\n",
                "\t\n",
                |k| {
                    let [w, a, m] = motion(k);
                    let numbers = a.into_iter().chain(w).chain(m);
                    format!(
                        "{}.0\t{}",
                        START / 1_000_000 + k as i64 * 10,
                        joined("\t", numbers)
                    )
                },
            )
        },
        Made {
            gyro_unit: None,
            accel: Some((force, G)),
            mag: Some(microtesla),
            ..table(
                "plain.tsv",
                "time_s\tgyro_x\tgyro_y\tgyro_z\tacc_x_g\tacc_y_g\tacc_z_g\tmag_x_uT\tmag_y_uT\tmag_z_uT\n",
                "\n",
                |k| format!("{}\t{}", secs(k), joined("\t", motion(k).concat())),
            )
        },
        Made {
            stamp: |k| START + k as i64 * STEP,
            gyro_unit: Some(GyroUnit::Mrad),
            ..table(
                "dated.txt",
                "timestamp | omega_x (mrad/s) | omega_y (mrad/s) | omega_z (mrad/s)\n",
                "\n",
                |k| {
                    format!(
                        "2023-11-14T22:13:20.{:02}Z | {}",
                        k,
                        joined(" | ", motion(k)[0])
                    )
                },
            )
        },
        Made {
            stamp: |k| START + k as i64 * STEP,
            gyro_unit: Some(GyroUnit::Deg),
            ..table(
                "columns.dat",
                "# written by hand\n#  t_us   wx_dps   wy_dps  wz_dps\n",
                "\n",
                |k| {
                    format!(
                        "  {}   {}",
                        (START + k as i64 * STEP) / 1000,
                        joined("  ", motion(k)[0])
                    )
                },
            )
        },
        Made {
            stamp: |k| (k as i64 + 1) * STEP,
            gyro_unit: None,
            ..table("loop.csv", "dt,gx,gy,gz\n", "\n", |k| {
                format!("0.010,{}", joined(",", motion(k)[0]))
            })
        },
        Made {
            stamp: |k| k as i64 * 16_667_000,
            gyro: increments::turned,
            accel: Some((increments::pushed, SI)),
            mag: Some(field),
            ..table(
                "dot increments.csv",
                "sep=,\nDeviceTag:,Movella DOT 1\nOutputRate:,60Hz\n\nPacketCounter,SampleTimeFine,dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3],Mag_X,Mag_Y,Mag_Z,Status\n",
                "\n",
                |k| {
                    let numbers = increments::quaternion(k);
                    let numbers = numbers.into_iter().chain(increments::velocity(k));
                    format!(
                        "{k},{},{},0",
                        k * 16_667,
                        joined(",", numbers.chain(motion(k)[2]))
                    )
                },
            )
        },
    ]
}

#[track_caller]
fn check(made: &Made, given: &Given) {
    let name = made.name;
    assert_eq!(given.bad, [], "{name}");
    assert_eq!(given.samples.len(), ROWS, "{name}");
    assert_eq!(given.gyro, made.gyro_unit, "{name}");
    for (k, sample) in given.samples.iter().enumerate() {
        assert_eq!(
            sample.header,
            Some(Nanos((made.stamp)(k))),
            "{name}, row {k}"
        );
        assert_eq!(sample.log, Nanos((made.stamp)(k)), "{name}, row {k}");
        assert_eq!(sample.gyro, Some((made.gyro)(k)), "{name}, row {k}");
        assert_eq!(
            sample.accel,
            made.accel.map(|(accel, _)| accel(k)),
            "{name}, row {k}"
        );
        assert_eq!(sample.mag, made.mag.map(|mag| mag(k)), "{name}, row {k}");
        match (sample.orientation, made.orientation) {
            (Some(found), Some(true_one)) => {
                let off = found.iter().zip(true_one).map(|(a, b)| (a - b).abs());
                assert!(
                    off.fold(0.0, f64::max) < 1e-15,
                    "{name}, row {k}: {found:?}"
                );
            }
            (found, none) => assert_eq!(found, none, "{name}, row {k}"),
        }
    }
    let unit = made.accel.and_then(|(_, unit)| unit);
    assert_eq!(given.accel, unit, "{name}");
}

#[test]
fn every_makers_table_gives_the_numbers_that_were_written_to_the_bit() {
    for made in all() {
        let given = read(made.name, made.text.as_bytes(), &options("")).unwrap();
        check(&made, &given);
    }
}

#[test]
fn however_the_bytes_come_the_items_are_the_same() {
    for made in all() {
        // Something wrong in it, and the header once more.
        let mut text = made.text.clone();
        let at = text.len() * 2 / 3;
        text.insert_str(at, "\u{fffd},x\n1,2\n\n");
        text.push_str(&made.text);
        let whole = read(made.name, text.as_bytes(), &options("")).unwrap();
        assert!(!whole.bad.is_empty());
        for at_once in [1, 2, 7, 63, 64, 65, 4095, 4096, 70_000] {
            let given = read(made.name, Dribble(text.as_bytes(), at_once), &options(""));
            assert_eq!(given.unwrap(), whole, "{} by {at_once}", made.name);
        }
        // Line ends of other systems, blank lines, a mark of byte order.
        let other = format!(
            "\u{feff}{}",
            made.text.replace("\r\n", "\n").replace('\n', "\r\n\r\n")
        );
        let given = read(made.name, other.as_bytes(), &options("")).unwrap();
        check(&made, &given);
    }
}

#[test]
fn what_it_says_it_assumed_gives_the_same_when_it_is_said() {
    for made in all() {
        let given = read(made.name, made.text.as_bytes(), &options("")).unwrap();
        let again = read("-", made.text.as_bytes(), &options(&given.assumed)).unwrap();
        assert_eq!(again.assumed, given.assumed, "{}", made.name);
        check(&made, &again);
    }
}

#[test]
fn columns_that_the_user_names_or_numbers_are_believed_in_everything_else_too() {
    let made = &all()[7];
    let text = made.text.as_bytes();
    let by_number = read(
        "-",
        text,
        &options("gyro=4:3:2:rad/s,stamp=1:ms,accel=none"),
    )
    .unwrap();
    let [x, y, z] = motion(5)[0];
    let sample = by_number.samples[5];
    assert_eq!((sample.gyro, sample.accel), (Some([z, y, x]), None));
    assert_eq!(
        sample.header,
        Some(Nanos((392_093_562 + 5 * 20_034) * 1_000_000))
    );
    assert_eq!(by_number.gyro, Some(GyroUnit::Rad));
    // Of a table without a header, and of one whose names say nothing.
    let rows: String = made
        .text
        .lines()
        .skip(1)
        .map(|row| format!("{row}\n"))
        .collect();
    for head in ["", "a,b,c,d,e,f,g\n", "// made\n\n"] {
        let text = format!("{head}{rows}");
        let columns = options("gyro=2:3:4:deg/s,stamp=1:us,accel=5:6:7:g");
        let given = read("-", text.as_bytes(), &columns).unwrap();
        check(made, &given);
    }
    let semicolons = made.text.replace(',', ":");
    let options = Options {
        delimiter: Some(":".parse().unwrap()),
        ..Options::default()
    };
    check(made, &read("-", semicolons.as_bytes(), &options).unwrap());
}

#[test]
fn acceleration_without_gravity_is_named_and_not_used() {
    let head = "Time (s),Gyroscope x (rad/s),Gyroscope y (rad/s),Gyroscope z (rad/s),Linear Acceleration x (m/s^2),Linear Acceleration y (m/s^2),Linear Acceleration z (m/s^2)\n";
    let text = format!("{head}0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n0.02,1,2,3,4,5,6\n");
    let given = read("-", text.as_bytes(), &options("")).unwrap();
    assert!(given.samples.iter().all(|s| s.accel.is_none()));
    let [note] = given.notes.as_slice() else {
        panic!("{:?}", given.notes);
    };
    for word in [
        "`Linear Acceleration x (m/s^2)`",
        "is not used",
        "without gravity",
        "columns accel=",
    ] {
        assert!(note.contains(word), "`{word}` is missing: {note}");
    }
    let columns = note
        .split("columns ")
        .nth(1)
        .unwrap()
        .split(" uses")
        .next()
        .unwrap();
    let given = read("-", text.as_bytes(), &options(columns)).unwrap();
    assert_eq!(given.samples[0].accel, Some([4.0, 5.0, 6.0]));
}

/// Rows a second on one thread, of seven columns as EuRoC has them.
#[test]
#[ignore = "a figure: --release -- --ignored --nocapture rows_a_second"]
fn rows_a_second() {
    let head = all()[0].text.lines().next().unwrap().to_owned() + "\n";
    let mut text = head;
    for k in 0..1_000_000 {
        let [w, a, _] = motion(k);
        let numbers: Vec<String> = w.iter().chain(&a).map(|v| format!("{v:.9}")).collect();
        writeln!(
            text,
            "{},{}",
            START + k as i64 * 5_000_000,
            numbers.join(",")
        )
        .unwrap();
    }
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let name = Path::new("data.csv");
        let mut lines = Lines::new(name, Format::Table, text.as_bytes(), &options("")).unwrap();
        let mut samples = Vec::new();
        let start = std::time::Instant::now();
        let mut n = 0;
        while let Some(line) = lines.next(&mut samples).unwrap() {
            n += usize::from(line.is_ok());
            if samples.len() > 1000 {
                samples.clear();
            }
        }
        assert_eq!(n, 1_000_000);
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!(
        "{:.2} M rows/s, {:.0} MB/s",
        1.0 / best,
        text.len() as f64 / best * 1e-6
    );
}
