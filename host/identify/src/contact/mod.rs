//! Identification of a contact: stiffness, damping, exponent, restitution and friction from presses, impacts and tosses.

pub mod estimate;
pub mod law;
pub mod population;
pub mod search;
pub mod toss;
pub mod touches;
pub mod uncertainty;
