//! The one test binary: each module proves one part of the house.

mod bad_input;
mod cli;
mod house;
mod oracles;
