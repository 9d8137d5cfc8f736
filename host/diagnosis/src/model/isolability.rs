//! Isolability: blocks with measured inputs and outputs, and the effects that act in each, before any data are read.

use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use serde::Serialize;
use softdock_kernels::effects::{Effect, row_of};

/// Block of the loop with its channels.
#[derive(Clone, Debug, Serialize)]
pub struct BlockView {
    /// The block.
    pub block: &'static str,
    /// Input signals.
    pub inputs: Vec<&'static str>,
    /// Output signals.
    pub outputs: Vec<&'static str>,
    /// Missing signals, without which the block cannot be diagnosed.
    pub missing: Vec<&'static str>,
    /// Catalogue ids of the effects that act in it.
    pub effects: Vec<&'static str>,
}

impl BlockView {
    /// Builds the view of a block that is diagnosed.
    pub(crate) fn judged(
        block: &MeasuredBlock,
        library: &[Hypothesis],
        inputs: &[&'static str],
        outputs: &[&'static str],
    ) -> Self {
        let mut effects: Vec<&'static str> = library.iter().map(|hypothesis| hypothesis.effect.id).collect();
        // Forms of one effect stand next to one another.
        effects.dedup();
        Self { block: block.name, inputs: inputs.to_vec(), outputs: outputs.to_vec(), missing: Vec::new(), effects }
    }

    /// Builds the view of a block with missing signals.
    pub(crate) fn closed(
        block: &'static str,
        inputs: &[&'static str],
        outputs: &[&'static str],
        missing: &[&'static str],
    ) -> Self {
        let (inputs, outputs) = (inputs.to_vec(), outputs.to_vec());
        Self { block, inputs, outputs, missing: missing.to_vec(), effects: Vec::new() }
    }
}

/// Returns the isolability matrix as text: rows are effects, columns are residuals.
pub fn text(blocks: &[BlockView]) -> String {
    let mut out = String::from("Isolability with these channels (rows: effects, columns: residuals that show them)\n");
    for (number, block) in blocks.iter().enumerate() {
        let (inputs, outputs) = (block.inputs.join(", "), block.outputs.join(", "));
        let missing = match block.missing.is_empty() {
            true => String::new(),
            false => format!(": not diagnosed, no {}", block.missing.join(", ")),
        };
        out += &format!("  r{} {}: {inputs} -> {outputs}{missing}\n", number + 1, block.block);
    }
    let mut ids: Vec<&str> = blocks.iter().flat_map(|block| block.effects.iter().copied()).collect();
    ids.sort_unstable();
    ids.dedup();
    let head: String = (1..=blocks.len()).map(|number| format!("  r{number}")).collect();
    out += &format!("  {:<26}{head}\n", "");
    for id in ids {
        let mark = |block: &BlockView| if block.effects.contains(&id) { "   x" } else { "   ." };
        let words = row_of(id).map_or_else(String::new, Effect::words);
        out += &format!("  {id:<26}{}  {words}\n", blocks.iter().map(mark).collect::<String>());
    }
    out
}
