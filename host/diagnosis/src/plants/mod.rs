//! Plants: each with its blocks, hypotheses, views and random effects, in a folder of its name.

pub mod body;
pub mod command;
pub mod contact;
pub mod drive;
pub mod facility;
pub mod robot;
pub mod sensor;
pub mod toss;
