//! numpy arrays -> attitudes as numpy arrays: the compiled half of the Python package `strapd`.
//!
//! What a user sees is written in Python (`python/strapd`); here is what has to be fast. Everything is computed by
//! `strapd-attitude`, the path of the command `strapd replay`, so that both give the same bits.
//!
//! | module | arrow |
//! |---|---|
//! | [`settings`] | keyword arguments -> a checked plan |
//! | [`samples`] | arrays, one row a sample -> raw samples |
//! | [`columns`] | attitudes -> columns -> numpy arrays over their memory |
//! | [`batch`] | all samples at once -> attitudes |
//! | [`live`] | samples as they come -> attitudes |
//! | [`facts`] | what became of a run -> a dict |
//! | [`calibration`] | the calibration of a sensor <-> a dict |
//! | [`compared`] | two attitudes -> how far apart |
//! | [`written`] | bytes that the command writes -> attitudes |

// What is documented is the Python package; here for who changes it.
#![allow(missing_docs, unreachable_pub)]

use pyo3::prelude::*;

mod batch;
mod calibration;
mod columns;
mod compared;
mod facts;
mod live;
mod refusal;
mod samples;
mod settings;
mod written;

#[pymodule]
mod _strapd {
    #[pymodule_export]
    use crate::batch::estimate;
    #[pymodule_export]
    use crate::compared::compare;
    #[pymodule_export]
    use crate::live::Live;
    #[pymodule_export]
    use crate::settings::check_settings;
    #[pymodule_export]
    use crate::written::Written;

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods as _;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
