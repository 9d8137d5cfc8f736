//! The `softdock` command.

fn main() {}
