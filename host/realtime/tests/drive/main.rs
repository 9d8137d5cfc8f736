//! Whole drives in virtual time: in process, over the protocols, and with everything that can go wrong on the way.

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
