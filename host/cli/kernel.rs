//! `softdock kernel`: the WGSL that a scenario becomes.

use crate::args::KernelArgs;
use crate::words::{Exit, say};
use softdock_kernels::frame::Batch;
use softdock_kernels::plant::Plant;
use softdock_tracer::kernel::kernel;

/// Prints the module: structs with units and meanings, the frame, the traced stages with their operation counts.
pub(crate) fn kernel_listing(args: &KernelArgs) -> miette::Result<Exit> {
    let scenario = softdock_campaign::load_scenario(&args.scenario)?;
    say(kernel(&Plant::new(scenario.model), Batch::whole()).text);
    Ok(Exit::Done)
}
