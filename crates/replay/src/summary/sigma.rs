//! Terms of a run's sigma -> words, JSON. Pure.
//!
//! Apart from the summary because a sigma is worth what is in it: each term by its name, with its size, and the flag
//! that says another.

use super::significant;
use nalgebra::Matrix3;
use serde_json::{Value, json};
use strapd_attitude::aid::Settings;
use strapd_attitude::estimate::{Bias, EstimationSettings, Initial, Prepared};
use strapd_attitude::setting::{BIAS, CALIBRATION, INIT, NOISE};

/// One thing that is not known.
#[derive(Clone, PartialEq, Debug)]
struct Term {
    /// Stable name for machines.
    name: &'static str,
    words: &'static str,
    /// About the body's axes; the same thrice where it is one.
    value: [f64; 3],
    unit: &'static str,
    /// Note that follows it.
    note: String,
}

/// Terms that sigma holds.
#[derive(Clone, PartialEq, Debug)]
pub struct SigmaTerms {
    is_filtered: bool,
    class: String,
    terms: Vec<Term>,
}

/// rad/s to deg/h.
fn per_hour(v: f64) -> f64 {
    v.to_degrees() * 3600.0
}

impl SigmaTerms {
    /// Makes them of a run as planned and prepared; `bridged` gaps were integrated across.
    #[must_use]
    pub fn of(plan: &EstimationSettings, prepared: &Prepared, bridged: u64) -> SigmaTerms {
        let mut terms = match &prepared.aiding {
            Some(aiding) => filtered(&aiding.settings),
            None => alone(plan, prepared.bias_sigma.into(), prepared.tilt_sigma),
        };
        terms.push(Term {
            name: "bridged_gaps",
            words: "gaps bridged:",
            value: [bridged as f64; 3],
            unit: "",
            note: String::new(),
        });
        SigmaTerms {
            is_filtered: prepared.aiding.is_some(),
            class: prepared.noise.name.clone(),
            terms,
        }
    }

    /// Text in one line: what is in it, and the flag for another class.
    #[must_use]
    pub fn text(&self) -> String {
        let said = self.terms.iter().filter(|t| t.value != [0.0; 3]);
        let said: Vec<String> = said.map(Term::text).collect();
        if said.is_empty() {
            return format!("of nothing: {NOISE} CLASS says what the sensor is");
        }
        let by = if self.is_filtered {
            format!("the filter's, priors of class {}", self.class)
        } else {
            format!("class {}", self.class)
        };
        format!("of ({by}, {NOISE}): {}", said.join(", "))
    }

    /// JSON for machines: every term by its name, those that are nothing with 0.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "by": if self.is_filtered { "filter" } else { "noise" },
            "class": self.class,
            "flag": NOISE.to_string(),
            "terms": self.terms.iter().map(|t| (t.name.to_owned(), t.json()))
                .collect::<serde_json::Map<_, _>>(),
        })
    }
}

/// Terms of the gyro alone.
fn alone(plan: &EstimationSettings, bias_sigma: [f64; 3], tilt_sigma: f64) -> Vec<Term> {
    let known = plan.calibration.as_deref();
    let noise = &known.map_or_else(|| plan.noise.clone(), |known| known.narrowed(&plan.noise));
    let (turn_on, note) = match plan.bias {
        Bias::Unsaid | Bias::None if known.is_some_and(|known| known.bias.is_some()) => (
            bias_sigma,
            format!(" (left by {CALIBRATION}, flicker in it)"),
        ),
        Bias::Unsaid | Bias::None => (noise.turn_on_bias, format!(" ({BIAS} removes it)")),
        Bias::Auto | Bias::Given(_) => (noise.left_of_turn_on(), format!(" (left by {BIAS})")),
    };
    let (initial, note_of_start) = match plan.initial {
        Initial::Gravity => (
            noise.levelled(tilt_sigma).initial,
            format!(" ({INIT} gravity)"),
        ),
        _ => (noise.initial, String::new()),
    };
    let term = |name, words, value, unit, note: &str| Term {
        name,
        words,
        value,
        unit,
        note: note.to_owned(),
    };
    vec![
        term(
            "white_noise",
            "white noise",
            noise.arw.map(|v| v.to_degrees() * 60.0),
            "deg/sqrt(h)",
            "",
        ),
        term(
            "flicker",
            "flicker",
            noise.flicker().map(per_hour),
            "deg/h",
            "",
        ),
        term(
            "rate_random_walk",
            "rate random walk",
            noise.rrw.map(f64::to_degrees),
            "deg/s/sqrt(s)",
            "",
        ),
        term(
            "turn_on_bias",
            "turn-on bias",
            turn_on.map(f64::to_degrees),
            "deg/s",
            &note,
        ),
        term(
            "scale",
            "scale",
            [noise.scale * 100.0; 3],
            "%",
            " of the angle turned",
        ),
        term(
            "axes",
            "misalignment",
            [noise.misalignment.to_degrees(); 3],
            "deg",
            "",
        ),
        term(
            "initial_tilt",
            "initial attitude",
            initial.map(f64::to_degrees),
            "deg",
            &note_of_start,
        ),
    ]
}

/// Terms of the filter: what it began with, and learned since.
fn filtered(settings: &Settings) -> Vec<Term> {
    let one = |name, words, value: f64, unit, note: &str| Term {
        name,
        words,
        value: [value; 3],
        unit,
        note: note.to_owned(),
    };
    let field = |value: f64| if settings.has_field { value } else { 0.0 };
    // A calibration's sigmas take the place of the class's: of the worst axis.
    let worst = |variances: &[f64]| variances.iter().copied().fold(0.0, f64::max).sqrt();
    let prior = &settings.prior;
    let three = |known: Option<Matrix3<f64>>, class: f64| {
        known.map_or(class, |p| worst(p.diagonal().as_slice()))
    };
    let bias = three(prior.bias, settings.bias_prior);
    let force_bias = three(prior.force_bias, settings.force_bias_prior);
    let [scale, cross] = prior
        .scale
        .map_or([settings.scale_prior, settings.cross_prior], |p| {
            let (scale, axes) = (p.fixed_view::<3, 3>(0, 0), p.fixed_view::<3, 3>(3, 3));
            [scale.diagonal(), axes.diagonal()].map(|v| worst(v.as_slice()))
        });
    vec![
        one(
            "white_noise",
            "white noise",
            settings.gyro_noise.to_degrees() * 60.0,
            "deg/sqrt(h)",
            "",
        ),
        one(
            "bias_walk",
            "bias random walk",
            settings.bias_walk.to_degrees(),
            "deg/s/sqrt(s)",
            "",
        ),
        one(
            "bias_by_tilt",
            "g-sensitivity",
            settings.bias_by_tilt.to_degrees(),
            "deg/s/g",
            "",
        ),
        one("bias", "bias", bias.to_degrees(), "deg/s", " at first"),
        one("scale", "scale", scale * 100.0, "%", " at first"),
        one(
            "axes",
            "misalignment",
            cross.to_degrees(),
            "deg",
            " at first",
        ),
        one(
            "accelerometer_bias",
            "accelerometer bias",
            force_bias,
            "m/s^2",
            " at first",
        ),
        one(
            "accelerometer_lead",
            "accelerometer time offset",
            settings.prior.lead_sigma.unwrap_or(settings.lead_prior) * 1e3,
            "ms",
            " at first",
        ),
        one(
            "initial_tilt",
            "initial tilt",
            settings.tilt_start.to_degrees(),
            "deg",
            " and what the accelerations hide of it",
        ),
        one(
            "initial_heading",
            "heading of the first field",
            field(settings.heading_start.to_degrees()),
            "deg",
            "",
        ),
        one(
            "delay",
            "delay of the sensor's filters",
            settings.delay * 1e3,
            "ms",
            "",
        ),
        one(
            "case",
            "mounting misalignment",
            settings.case.to_degrees(),
            "deg",
            "",
        ),
        one(
            "hard_iron",
            "hard iron",
            field(settings.hard_iron * 100.0),
            "%",
            " of the first field",
        ),
    ]
}

impl Term {
    fn text(&self) -> String {
        let [x, y, z] = self.value.map(|v| significant(v, 2));
        let value = match self.name {
            "bridged_gaps" => format!("{}", self.value[0]),
            _ if x == y && y == z => x,
            _ => format!("{x}/{y}/{z}"),
        };
        let space = if self.unit.is_empty() { "" } else { " " };
        format!("{} {value}{space}{}{}", self.words, self.unit, self.note)
    }

    fn json(&self) -> Value {
        let [x, y, z] = self.value;
        let value = if x == y && y == z {
            json!(x)
        } else {
            json!([x, y, z])
        };
        json!({ "value": value, "unit": self.unit })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use strapd_attitude::estimate::Noise;

    fn words(plan: &EstimationSettings) -> String {
        let terms = alone(plan, [0.0; 3], 0.0);
        let terms = SigmaTerms {
            is_filtered: false,
            class: plan.noise.name.clone(),
            terms,
        };
        terms.text()
    }

    #[test]
    fn what_bias_and_init_leave_is_said_and_what_is_nothing_is_not() {
        let plan = EstimationSettings {
            noise: Noise::named("consumer").unwrap(),
            ..EstimationSettings::default()
        };
        let said = words(&plan);
        assert!(said.contains("class consumer, noise"), "{said}");
        assert!(
            said.contains("turn-on bias 1.0 deg/s (bias removes it)"),
            "{said}"
        );
        assert!(
            said.contains("flicker 8.5 deg/h") && !said.contains("initial"),
            "{said}"
        );
        let removed = EstimationSettings {
            bias: Bias::Auto,
            initial: Initial::Gravity,
            ..plan.clone()
        };
        let said = words(&removed);
        assert!(
            said.contains("turn-on bias 0.030 deg/s (left by bias)"),
            "{said}"
        );
        assert!(
            said.contains("initial attitude 1.1 deg (init gravity)"),
            "{said}"
        );
        let mut given = plan.clone();
        given.noise = Noise {
            name: "arw=1e-4/2e-4/3e-4".to_owned(),
            arw: [1e-4, 2e-4, 3e-4],
            bias_instability: [0.0; 3],
            turn_on_bias: [0.0; 3],
            scale: 0.0,
            misalignment: 0.0,
            ..plan.noise
        };
        let said = words(&given);
        assert!(
            said.ends_with("white noise 0.34/0.69/1.0 deg/sqrt(h)"),
            "{said}"
        );
    }
}
