//! Sessions in virtual time: in process, over the protocols, with all faults.

mod checks;
mod delay;
mod faults;
mod fixture;
mod in_process;
mod loopback;
mod mixed;
mod over_rsi;
mod replay;
mod safety;
mod scene;
mod sessions;
mod torque;
mod urdf;
