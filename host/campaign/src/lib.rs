//! Campaign and scenario files: read as written, checked into types that cannot be wrong, drawn run by run.

pub mod requirement;
