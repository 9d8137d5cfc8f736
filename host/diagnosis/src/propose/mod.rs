//! Discriminating experiments of an ambiguous answer: a motion of a joint, or a run of a campaign.

pub mod experiment;
pub(crate) mod motion;
pub(crate) mod next_drive;
