//! The repository's spoiled files, run with this package alone.

#[path = "../../../tests/bad_input.rs"]
mod bad_input;
