//! Identification of the robots from measured data: recordings, regressor, least squares, physically consistent models.

pub mod base;
pub mod choose;
pub mod consistent;
pub mod elasticity;
mod error;
pub mod excitation;
pub mod filter;
mod identify;
pub mod layout;
pub mod log;
pub mod marks;
pub mod model;
pub mod motion;
pub mod motion_page;
pub mod regressor;
pub mod report;
pub mod series;
pub mod system;
pub mod whiteness;

pub use error::{Error, Result};
pub use identify::{Compared, Comparison, Identification, Options, identify, identify_recordings};
