//! Public interface of the gauntlet: data sets are repeatable, and hidden effects follow their laws.

mod body;
mod drive;
mod replay;
mod sensor;
mod sets;
mod support;
