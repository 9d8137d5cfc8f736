//! ABB.
