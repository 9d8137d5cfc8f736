//! Identification of a contact: stiffness, damping, exponent, restitution and friction from presses, impacts and tosses.

pub mod block;
pub mod estimate;
pub mod identification;
pub mod law;
pub mod population;
pub mod report;
pub mod search;
pub mod toss;
pub mod touches;
pub mod uncertainty;
