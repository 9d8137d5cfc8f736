//! Gauntlet in measured recordings: effects planted in data of real machines, and changes that change nothing.
//!
//! A [`sets::MeasuredSet`] is measured recordings with a model. Its unchanged diagnosis is the reference. A case plants a
//! known effect in the recordings or in the model, or changes their form alone (rows, names, units, rate); everything
//! else stays as it was measured. Answers with and without the change are compared.

pub mod cases;
pub mod forms;
pub mod grade;
pub mod score;
pub mod sets;
mod table;
pub mod trial;
pub mod untouched;
