//! Inference of the hypothesis that explains a block's residuals: noise from repeats, fits by simulation, evidence,
//! search, admissibility, adequacy.

pub mod adequacy;
pub(crate) mod admissibility;
pub(crate) mod autocorrelation;
pub mod bank;
pub(crate) mod bootstrap;
mod combine;
pub mod dead_zone;
pub mod errors_in_variables;
pub mod evidence;
pub mod fit;
pub mod identifiability;
pub mod judge;
pub mod latent;
pub mod noise;
pub mod parameter_deviations;
pub mod recordings;
pub mod response;
pub mod selection;
mod shortcut;
pub mod torque_error;
mod trend;
pub mod unmodelled;
pub(crate) mod white_noise;
