//! numpy arrays -> attitudes as numpy arrays: the compiled half of the Python package `strapd`.
//!
//! What a user sees is written in Python (`python/strapd`); here is what has to be fast. Everything is computed by
//! `strapd-attitude` and read by `strapd-replay`, the path of the command `strapd replay`, so that both give the same
//! bits.
//!
//! | module | arrow |
//! |---|---|
//! | [`settings`] | keyword arguments -> a checked plan |
//! | [`samples`] | arrays, one row a sample -> raw samples |
//! | [`columns`] | attitudes -> columns -> numpy arrays over their memory |
//! | [`batch`] | all samples at once -> attitudes |
//! | [`live`] | samples as they come -> attitudes |
//! | [`calibration`] | the calibration of a sensor <-> a dict |
//! | [`compared`] | two attitudes -> how far apart |
//! | [`between`] | attitudes of a run -> attitudes at other instants |
//! | [`joint`] | attitudes of two bodies -> one relative to the other |
//! | [`words`] | the command's flags -> a replay to be done |
//! | [`recorded`] | a recorded log -> attitudes |
//! | [`samples_of_log`], [`simulated`], [`raw_columns`] | a recorded log, or a motion -> samples as numpy arrays |
//! | [`looked`] | a recorded log -> what is in it, and what may spoil it |
//! | [`errand`], [`noted`] | work that Ctrl-C ends, and what is said on the way |

// What is documented is the Python package; here for who changes it.
#![allow(missing_docs, unreachable_pub)]

use pyo3::prelude::*;

mod batch;
mod between;
mod calibration;
mod columns;
mod compared;
mod errand;
mod joint;
mod live;
mod looked;
mod noted;
mod raw_columns;
mod recorded;
mod refusal;
mod samples;
mod samples_of_log;
mod settings;
mod simulated;
mod words;

#[pymodule]
mod _strapd {
    #[pymodule_export]
    use crate::batch::estimate;
    #[pymodule_export]
    use crate::between::at;
    #[pymodule_export]
    use crate::compared::compare;
    #[pymodule_export]
    use crate::joint::relative;
    #[pymodule_export]
    use crate::live::Live;
    #[pymodule_export]
    use crate::looked::{check_log, info};
    #[pymodule_export]
    use crate::recorded::replay;
    #[pymodule_export]
    use crate::samples_of_log::read;
    #[pymodule_export]
    use crate::settings::check_settings;
    #[pymodule_export]
    use crate::simulated::simulate;

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods as _;
        // As flags, which `check` advises for the command; what arguments they are is `refusal`'s, since arrays and logs have
        // other ones.
        let _ = strapd_attitude::setting::name_settings(|name, f| {
            write!(f, "--{}", name.replace('_', "-"))
        });
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
