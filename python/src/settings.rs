//! Keyword arguments -> a checked plan. Pure but for Python's objects.
//!
//! The values are those of the command's flags, in Python's own types: a number is a number and a vector a sequence.

use crate::calibration;
use crate::refusal::argument;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::str::FromStr;
use std::sync::Arc;
use strapd_attitude::condition::{GyroUnit, OnGap};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    Aid, Bias, Initial, NOISE_FIGURES, NOISE_PRESETS, Noise, Plan, Truncation,
};
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::SampleKind;

/// Every name there is.
const NAMES: [&str; 28] = [
    "method",
    "window",
    "order",
    "kind",
    "gyro_unit",
    "body",
    "world",
    "mount",
    "init",
    "bias",
    "max_gap",
    "on_gap",
    "earth_rate",
    "regularise_stamps",
    "gyro_range",
    "noise",
    "aid",
    "smooth",
    "accel_sign",
    "mag_mount",
    "mag_hard_iron",
    "declination",
    "undo_truncation",
    "sensor_delay",
    "calibration",
    "start",
    "until",
    "finals",
];

/// The settings of a run, by name; `None` is the same as absent.
pub struct Given<'a, 'py>(&'a Bound<'py, PyDict>);

impl<'a, 'py> Given<'a, 'py> {
    fn get(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.0.get_item(name)?.filter(|value| !value.is_none()))
    }

    fn number(&self, name: &str) -> PyResult<Option<f64>> {
        self.get(name)?
            .map(|value| {
                let number = value.extract::<f64>();
                number.map_err(|_| {
                    argument(format!(
                        "{name}: a number is expected, not {}",
                        shown(&value)
                    ))
                })
            })
            .transpose()
    }

    fn text(&self, name: &str) -> PyResult<Option<String>> {
        self.get(name)?
            .map(|value| {
                let text = value.extract::<String>();
                text.map_err(|_| {
                    argument(format!("{name}: a name is expected, not {}", shown(&value)))
                })
            })
            .transpose()
    }

    fn truth(&self, name: &str) -> PyResult<bool> {
        self.get(name)?.map_or(Ok(false), |value| {
            let truth = value.extract::<bool>();
            truth.map_err(|_| {
                argument(format!(
                    "{name}: True or False is expected, not {}",
                    shown(&value)
                ))
            })
        })
    }

    fn one_of<T: Copy>(&self, name: &str, all: &[(&str, T)]) -> PyResult<Option<T>> {
        let Some(text) = self.text(name)? else {
            return Ok(None);
        };
        let found = all.iter().find(|(known, _)| *known == text);
        found.map(|(_, value)| Some(*value)).ok_or_else(|| {
            let known: Vec<String> = all.iter().map(|(known, _)| format!("'{known}'")).collect();
            argument(
                Diagnostic::new(format!("{name}: there is no {text:?}"))
                    .help(format!("one of {}", known.join(", "))),
            )
        })
    }

    fn parsed<T: FromStr<Err: std::fmt::Display>>(&self, name: &str) -> PyResult<Option<T>> {
        self.text(name)?
            .map(|text| text.parse().map_err(|e| argument(format!("{name}: {e}"))))
            .transpose()
    }

    fn quaternion<To, From>(&self, name: &str) -> PyResult<Option<Quaternion<To, From>>> {
        self.get(name)?
            .map(|value| unit_quaternion(name, &value))
            .transpose()
    }
}

/// Text of a value in a message: never much of it.
fn shown(value: &Bound<'_, PyAny>) -> String {
    let kind = value
        .get_type()
        .name()
        .map_or_else(|_| "?".to_owned(), |name| name.to_string());
    let text = value
        .repr()
        .map_or_else(|_| String::new(), |text| text.to_string());
    let short: String = text.chars().take(40).collect();
    format!("{short} ({kind})")
}

fn unit_quaternion<To, From>(
    name: &str,
    value: &Bound<'_, PyAny>,
) -> PyResult<Quaternion<To, From>> {
    let q: [f64; 4] = value.extract().map_err(|_| {
        argument(format!(
            "{name}: four numbers w, x, y, z are expected, not {}",
            shown(value)
        ))
    })?;
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if norm.is_nan() || (norm - 1.0).abs() > 0.01 {
        return Err(argument(format!(
            "{name}: a unit quaternion w, x, y, z is needed, this one has norm {norm}"
        )));
    }
    Ok(Quaternion::assume_unit(q.map(|v| v / norm)))
}

/// The plan that these settings make, checked; `aid` is what it is without one.
pub fn plan(settings: &Bound<'_, PyDict>, aid: Aid) -> PyResult<Plan> {
    for name in settings.keys() {
        let name = name.extract::<String>()?;
        if !NAMES.contains(&name.as_str()) {
            return Err(PyTypeError::new_err(format!(
                "there is no setting {name:?}; there are {}",
                NAMES.join(", ")
            )));
        }
    }
    let given = Given(settings);
    let plain = Plan::default();
    let kinds = SampleKind::ALL.map(|kind| (kind.name(), kind));
    let units = [GyroUnit::Rad, GyroUnit::Deg, GyroUnit::Mrad].map(|unit| (unit.name(), unit));
    let on_gaps = [OnGap::Hold, OnGap::Bridge, OnGap::Reset].map(|policy| (policy.name(), policy));
    let aids = [
        ("auto", Aid::Auto),
        ("none", Aid::None),
        ("gravity", Aid::Gravity),
        ("gravity+mag", Aid::GravityAndField),
    ];
    let plan = Plan {
        method: method(&given)?,
        kind: given.one_of("kind", &kinds)?,
        unit: given.one_of("gyro_unit", &units)?,
        body: given.parsed("body")?,
        world: given.parsed("world")?.unwrap_or(plain.world),
        mount: given.quaternion("mount")?,
        initial: initial(&given)?,
        bias: bias(&given)?,
        max_gap_secs: given.number("max_gap")?.unwrap_or(plain.max_gap_secs),
        on_gap: given.one_of("on_gap", &on_gaps)?.unwrap_or_default(),
        latitude_deg: given.number("earth_rate")?,
        regularise_stamps: given.truth("regularise_stamps")?,
        gyro_range: given.number("gyro_range")?,
        noise: noise(&given)?,
        aid: given.one_of("aid", &aids)?.unwrap_or(aid),
        smooth: given.truth("smooth")?,
        is_accel_kinematic: given
            .one_of("accel_sign", &[("specific", false), ("kinematic", true)])?
            .unwrap_or(false),
        mag_mount: given.quaternion("mag_mount")?,
        mag_hard_iron: given.number("mag_hard_iron")?.unwrap_or(0.0),
        declination: given.number("declination")?.unwrap_or(0.0).to_radians(),
        truncation: truncation(&given)?,
        sensor_delay_secs: given.number("sensor_delay")?.unwrap_or(0.0),
        calibration: given
            .get("calibration")?
            .map(|known| calibration::read(&known).map(Arc::new))
            .transpose()?,
        start: given.number("start")?,
        until: given.number("until")?,
        ..plain
    };
    plan.check().map_err(argument)?;
    Ok(plan)
}

fn method(given: &Given<'_, '_>) -> PyResult<Method> {
    let name = given.text("method")?.unwrap_or_else(|| "auto".to_owned());
    let window = given
        .get("window")?
        .map(|value| {
            let window = value.extract::<usize>();
            window.map_err(|_| {
                argument(format!(
                    "window: a number of samples is expected, not {}",
                    shown(&value)
                ))
            })
        })
        .transpose()?;
    let order: Option<Order> = given
        .get("order")?
        .map(|value| {
            value
                .str()
                .and_then(|text| text.to_str().map(str::to_owned))
        })
        .transpose()?
        .map(|text| text.parse().map_err(|e| argument(format!("order: {e}"))))
        .transpose()?;
    method_of(&name, window, order, given.truth("finals")?).map_err(argument)
}

/// The method of a name, with window and order where they are given.
///
/// # Errors
/// In words, naming the argument.
pub fn method_of(
    name: &str,
    window: Option<usize>,
    order: Option<Order>,
    finals: bool,
) -> Result<Method, String> {
    let named: Method = match name {
        "causal" => Method::Magnus {
            window: 5,
            order: Order::M6,
            placement: Placement::Causal,
        },
        other => other.parse().map_err(|e| format!("method: {e}"))?,
    };
    Ok(match named {
        Method::Magnus {
            window: usual,
            order: plain,
            placement,
        } => Method::Magnus {
            window: window.unwrap_or(usual),
            order: order.unwrap_or(plain),
            placement,
        },
        Method::Live { order: plain, .. } => {
            let order = order.unwrap_or(plain);
            match window {
                Some(window) => Method::CommitProvisional {
                    window,
                    order,
                    finals,
                },
                None => Method::Live { order, finals },
            }
        }
        other if window.is_none() && order.is_none() => other,
        _ => {
            return Err(format!(
                "window, order: they belong to method 'magnus', 'causal' or 'commit', not to '{name}'"
            ));
        }
    })
}

fn initial(given: &Given<'_, '_>) -> PyResult<Initial> {
    let Some(value) = given.get("init")? else {
        return Ok(Initial::Identity);
    };
    let Ok(text) = value.cast::<PyString>() else {
        return unit_quaternion("init", &value).map(Initial::Given);
    };
    match text.to_str()? {
        "identity" => Ok(Initial::Identity),
        "gravity" => Ok(Initial::Gravity),
        "first-orientation" => Ok(Initial::FirstOrientation),
        _ => Err(argument(format!(
            "init: 'identity', 'gravity', 'first-orientation' or four numbers w, x, y, z, not {}",
            shown(&value)
        ))),
    }
}

fn bias(given: &Given<'_, '_>) -> PyResult<Bias> {
    let Some(value) = given.get("bias")? else {
        return Ok(Bias::Unsaid);
    };
    let wrong = || {
        argument(format!(
            "bias: 'none', 'auto' or three numbers in rad/s, not {}",
            shown(&value)
        ))
    };
    match value.cast::<PyString>() {
        Ok(text) => match text.to_str()? {
            "none" => Ok(Bias::None),
            "auto" => Ok(Bias::Auto),
            _ => Err(wrong()),
        },
        Err(_) => {
            let bias: [f64; 3] = value.extract().map_err(|_| wrong())?;
            Ok(Bias::Given(BodyRate(bias.into())))
        }
    }
}

fn truncation(given: &Given<'_, '_>) -> PyResult<Truncation> {
    let Some(value) = given.get("undo_truncation")? else {
        return Ok(Truncation::Unsaid);
    };
    let wrong = || {
        argument(format!(
            "undo_truncation: 'auto', 'on', 'off', or a step in rad/s above 0 and below 1, not {}",
            shown(&value)
        ))
    };
    match value.cast::<PyString>() {
        Ok(text) => match text.to_str()? {
            "auto" => Ok(Truncation::Auto),
            "on" => Ok(Truncation::On),
            "off" => Ok(Truncation::Off),
            _ => Err(wrong()),
        },
        Err(_) => {
            let step: f64 = value.extract().map_err(|_| wrong())?;
            if step > 0.0 && step < 1.0 {
                Ok(Truncation::Steps(step))
            } else {
                Err(wrong())
            }
        }
    }
}

/// A class by name, or a dict of figures in the units of data sheets, each one number or three about the body axes.
fn noise(given: &Given<'_, '_>) -> PyResult<Noise> {
    let Some(value) = given.get("noise")? else {
        return Ok(Plan::default().noise);
    };
    let classes = || {
        NOISE_PRESETS
            .map(|class| format!("'{}'", class.name))
            .join(", ")
    };
    if let Ok(text) = value.cast::<PyString>() {
        let name = text.to_str()?;
        let found = NOISE_PRESETS.iter().find(|class| class.name == name);
        return found.map(Noise::preset).ok_or_else(|| {
            argument(
                Diagnostic::new(format!("noise: there is no class {name:?}"))
                    .help(format!("one of {}, or a dict of figures", classes())),
            )
        });
    }
    let dict = value.cast::<PyDict>().map_err(|_| {
        argument(format!(
            "noise: a class ({}) or a dict of figures, not {}",
            classes(),
            shown(&value)
        ))
    })?;
    let mut given = Vec::new();
    for (key, figure) in dict.iter() {
        let key = key
            .extract::<String>()
            .map_err(|_| argument("noise: the figures have names"))?;
        let axes: [f64; 3] = match figure.extract::<f64>() {
            Ok(all) => [all; 3],
            Err(_) => figure.extract().map_err(|_| {
                argument(format!(
                    "noise: '{key}' is one number or three about the body axes, from 0 up, not {}",
                    shown(&figure)
                ))
            })?,
        };
        given.push((key, axes));
    }
    let figures = given.iter().map(|(key, axes)| (key.as_str(), *axes));
    Noise::of_figures("given", figures).map_err(|why| {
        let known = NOISE_FIGURES.map(|f| format!("{} ({})", f.key.replace('-', "_"), f.unit));
        argument(Diagnostic::new(format!("noise: {why}")).help(known.join(", ")))
    })
}

/// Checks settings without data.
#[pyfunction]
pub fn check_settings(settings: &Bound<'_, PyDict>) -> PyResult<()> {
    plan(settings, Aid::Auto).map(drop)
}
