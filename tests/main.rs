//! The one test binary: each module proves one part of the house.

mod bad_input;
mod cli;
mod gpu;
mod house;
mod kernel;
mod oracles;
mod parity;
