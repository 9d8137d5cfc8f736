//! What measured data say of the models: identification of the robots, and diagnosis of what a simulation gets wrong.

mod error;
pub mod identify;

pub use error::{Error, Result};
