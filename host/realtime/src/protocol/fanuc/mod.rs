//! FANUC.
