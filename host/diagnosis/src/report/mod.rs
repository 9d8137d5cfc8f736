//! Files and texts of an answer: page, terminal text, figures, extended model, command lines.

pub mod command_line;
pub mod extend;
mod figures;
pub mod missing_torque;
pub mod page;
pub mod result_files;
pub mod signals_text;
pub mod summary;
pub mod text;
pub mod wording;
