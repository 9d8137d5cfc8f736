//! `softdock merge`: several workers' folders into one, without gaps and clashes.

use crate::args::MergeArgs;
use crate::farm::end;
use crate::progress::Terminal;
use crate::words::Exit;

/// Joins and judges.
pub(crate) fn merge(args: &MergeArgs) -> miette::Result<Exit> {
    end(softdock_farm::merge(&args.parts, &args.out, Terminal::new().context()), false)
}
