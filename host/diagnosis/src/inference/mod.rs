//! Which hypothesis explains a block's residuals: noise from repeats, fits by simulation, evidence, adequacy.

pub mod adequacy;
pub mod bank;
pub(crate) mod bootstrap;
pub mod errors_in_variables;
pub mod evidence;
pub mod fit;
pub mod latent;
pub(crate) mod memory;
pub mod noise;
pub mod selection;
pub mod spread;
pub mod unknown;
pub(crate) mod white_noise;
