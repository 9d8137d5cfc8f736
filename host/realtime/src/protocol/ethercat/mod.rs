//! EtherCAT with CiA 402 drives: six axes and a rail in cyclic synchronous position.

pub mod cia402;
pub mod drives;
pub mod mapping;
pub mod scale;
