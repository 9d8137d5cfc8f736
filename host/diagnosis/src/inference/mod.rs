//! Inference of the hypothesis that explains a block's residuals: noise from repeats, fits by simulation, evidence,
//! adequacy.

pub mod adequacy;
pub(crate) mod autocorrelation;
pub mod bank;
pub(crate) mod bootstrap;
pub mod errors_in_variables;
pub mod evidence;
pub mod fit;
pub mod latent;
pub mod noise;
pub mod parameter_deviations;
pub mod selection;
pub mod unknown;
pub(crate) mod white_noise;
