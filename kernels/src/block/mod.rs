//! Blocks: parts of the loop on their own, fed with what was measured at their inputs, judged by what was measured at
//! their outputs.
//!
//! A block that is fed with measured inputs shows its own errors and nobody else's: its output is
//! compared with what was measured there.

pub mod body;
pub mod command;
pub mod contact;
pub mod controller;
pub mod drive;
mod forms;
pub mod low_pass;
mod replay;
pub mod sensor;
mod stairs;
pub mod toss;

pub use forms::Forms;
pub use replay::{Recorded, replay};
pub(crate) use replay::{Row, Samples};

#[cfg(test)]
mod body_tests;
#[cfg(test)]
mod command_tests;
#[cfg(test)]
mod contact_tests;
#[cfg(test)]
mod sensor_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod toss_tests;

use crate::fields::Bundle;
use crate::real::Real;

/// A part of the loop with measured inputs.
pub trait Block: Sync {
    /// Nominal values, effects and what may differ unnoticed.
    type Params<R: Real>: Bundle<R> + Copy;
    /// What is hidden inside.
    type State<R: Real>: Bundle<R> + Copy;
    /// Measured signals at an instant.
    type Input<R: Real>: Bundle<R> + Copy;
    /// Measured signals that reach the block late.
    type Late<R: Real>: Bundle<R> + Copy;
    /// What the block makes of them.
    type Output<R: Real>: Bundle<R> + Copy;

    /// How late the late signals are at a time since the recording's start \[s\].
    fn lateness<R: Real>(&self, p: &Self::Params<R>, time: R) -> R;

    /// The block as it has long been when the recording starts.
    fn start<R: Real>(&self, p: &Self::Params<R>, u: &Self::Input<R>, late: &Self::Late<R>) -> Self::State<R>;

    /// The block after a step \[s\] that ends at these signals.
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &Self::Params<R>,
        s: &Self::State<R>,
        u: &Self::Input<R>,
        late: &Self::Late<R>,
    ) -> Self::State<R>;

    /// Output of the block for these signals.
    fn output<R: Real>(
        &self,
        p: &Self::Params<R>,
        s: &Self::State<R>,
        u: &Self::Input<R>,
        late: &Self::Late<R>,
    ) -> Self::Output<R>;
}
