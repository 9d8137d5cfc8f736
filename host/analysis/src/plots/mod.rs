//! The report's figures: what each shows, from data to SVG.

pub mod axis;
pub(crate) mod bands;
pub(crate) mod canvas;
pub(crate) mod cells;
pub mod figure;
pub(crate) mod map;
pub(crate) mod scene;

use serde::Serialize;

/// A finished figure with its caption.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Drawing {
    pub(crate) svg: String,
    pub(crate) caption: String,
}
