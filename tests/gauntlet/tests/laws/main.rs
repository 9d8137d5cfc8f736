//! The gauntlet from outside: sets are repeatable, hide what they say, and hide it by its law.

mod body;
mod drive;
mod replay;
mod sensor;
mod sets;
mod support;
