//! The tables of `docs/top.md`, from live runs. Pure.

use crate::report::summary::significant;
use std::fmt::Write as _;
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_bodies::rigid_body::HeldRate;
use strapd_bodies::top::method_errors::{Course, How, propagated};
use strapd_bodies::top::{Case, SymmetricTop, TopMethod};

/// Rate and length of the two figures of the source document.
const FIGURES: [(f64, f64); 2] = [(2000.0, 1.2), (2500.0, 1.45)];

/// Fits of the rate: name, samples, placement.
const FITS: [(&str, usize, Placement); 6] = [
    ("linear (2 samples)", 2, Placement::Centred),
    ("quadratic, causal (3)", 3, Placement::Causal),
    ("cubic, causal (4)", 4, Placement::Causal),
    ("quintic, causal (6)", 6, Placement::Causal),
    ("quintic, centred (6)", 6, Placement::Centred),
    ("7th degree, centred (8)", 8, Placement::Centred),
];

/// A method for each rate that can be held.
type OfHeld = fn(HeldRate) -> TopMethod;

/// The columns of the table of methods, in its order.
const HELD: [(&str, OfHeld); 2] = [("live", TopMethod::Live), ("gyro", TopMethod::Gyro)];

/// Both tables as text.
pub(super) fn text() -> Result<String, String> {
    let mut out = String::from(
        "cusped top of the source document: largest error over the run, axis / attitude, degrees\n\n",
    );
    let _ = write!(out, "  {:<16}", "");
    for (name, _) in HELD {
        for held in ["w(t_i)", "w(t_i+1)", "mean"] {
            let _ = write!(out, "{:>20}", format!("{name} {held}"));
        }
    }
    out.push('\n');
    for (rate_hz, secs) in FIGURES {
        let course = cusped(rate_hz, secs)?;
        let _ = write!(out, "  {:<16}", format!("{rate_hz} Hz, {secs} s"));
        let methods: Vec<How> = HELD
            .into_iter()
            .flat_map(|(_, of)| {
                [HeldRate::Left, HeldRate::Right, HeldRate::Mean].map(|held| How::Top(of(held)))
            })
            .collect();
        for (_, worst) in course.errors(&methods)?.errors {
            let cell = [worst.axis, worst.attitude].map(|a| significant(a.to_degrees(), 3));
            let _ = write!(out, "{:>20}", cell.join(" / "));
        }
        out.push('\n');
    }
    out.push_str(
        "\nexact samples at 2000 Hz, attitude, degrees (first and last 8 samples, where windows are\none-sided, left out)\n\n  fit of the rate           Magnus order 4     order 6     exact\n",
    );
    let truth = cusped(2000.0, 1.2)?.truth()?;
    for (name, window, placement) in FITS {
        let _ = write!(out, "  {name:<24}");
        for order in [Order::M4, Order::M6, Order::Exact] {
            let method = Method::Magnus {
                window,
                order,
                placement,
            };
            let worst = propagated(method, &truth, MARGIN)?;
            let _ = write!(out, "{:>13}", significant(worst.attitude.to_degrees(), 2));
        }
        out.push('\n');
    }
    let auto = propagated(Method::Auto, &truth, 0)?;
    let _ = writeln!(
        out,
        "  auto (whole run)        {:>39}",
        significant(auto.attitude.to_degrees(), 2)
    );
    Ok(out)
}

/// Samples at either end where a window of 8 cannot be centred.
const MARGIN: usize = 8;

fn cusped(rate_hz: f64, secs: f64) -> Result<Course, String> {
    let top = SymmetricTop::published();
    let start = Case::Cusped
        .start(&top, Case::SEED_TILT, Case::SEED_W3)
        .map_err(|e| e.to_string())?;
    Course::new(top, start, rate_hz, secs)
}
