//! Physics against closed forms: the loop, its contact laws and its bodies.

mod arm_drives;
mod bench;
mod bodies;
mod bounce;
mod compensators;
mod contact_effects;
mod control;
mod docking;
mod effects;
mod facility;
mod floating;
mod held;
mod impedance;
mod insertion;
mod jamming;
mod lanes;
mod laws;
mod load;
mod map;
pub(crate) mod meshes;
mod nulls;
mod own_scenarios;
mod pairs;
mod scenes;
mod shapes;
mod sliding;
mod stability;
