//! Native part of the Python package `softdock`; `package/softdock/__init__.py` and its neighbours are what users see.

mod campaign;
mod error;
mod interrupt;
mod results;
mod table;

use pyo3::prelude::*;

#[pymodule(name = "_softdock")]
mod module {
    #[pymodule_export]
    use crate::campaign::{NativeCampaign, toml_text};
    #[pymodule_export]
    use crate::error::SoftdockError;
    #[pymodule_export]
    use crate::results::{NativeResults, compare_folders};
    #[pymodule_export]
    use crate::table::Table;
    use pyo3::prelude::*;

    /// Version of softdock.
    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "the name that Python users expect")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// Runs the command of a list of arguments, whose first one is the program's name; returns its exit code.
    #[pyfunction]
    fn command(py: Python<'_>, arguments: Vec<std::ffi::OsString>) -> u8 {
        py.detach(|| softdock::command(arguments))
    }
}
