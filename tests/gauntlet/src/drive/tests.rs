//! The drive's own tests.
