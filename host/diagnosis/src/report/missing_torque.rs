//! Table of the missing torques of drives.

use crate::inference::latent::Latent;
use crate::inference::unmodelled::Unmodelled;
use softdock_engine::blocks::BlockKind;
use softdock_input::csv_cell;

/// Returns the missing torques of all blocks as CSV; `None` if there are none.
pub fn table<'a>(all: impl Iterator<Item = &'a Unmodelled>) -> Option<String> {
    let inputs: Vec<String> = BlockKind::Drive.inputs().iter().map(|field| field.name.clone()).collect();
    let mut out = format!("experiment,t,{},missing,sd\n", inputs.join(","));
    let header = out.len();
    for missing in all.flat_map(|outside| &outside.missing) {
        let Latent { value, sd } = &missing.torque;
        for (knot, time) in missing.time.iter().enumerate() {
            let inputs: String = missing.inputs[knot].iter().map(|input| format!("{input},")).collect();
            out += &format!("{},{time},{inputs}{},{}\n", csv_cell(&missing.experiment), value[knot], sd[knot]);
        }
    }
    (out.len() > header).then_some(out)
}
