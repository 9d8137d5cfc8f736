//! Numbers that a stage reads by an index that it computes.

use std::sync::Arc;

/// A table of numbers. The kernels have those of all meshes in one buffer.
///
/// They are single precision on every backend, so that all read the same.
#[derive(Clone, Debug, PartialEq)]
pub struct LookupTable {
    /// The numbers; at least one.
    pub values: Arc<[f32]>,
    /// Place of the first in the kernels' buffer.
    pub offset: usize,
}

impl LookupTable {
    /// Number `index + step`, the last one beyond the end.
    #[inline(always)]
    pub fn at(&self, index: f64, step: usize) -> f64 {
        f64::from(self.values[(index as usize + step).min(self.values.len() - 1)])
    }
}
