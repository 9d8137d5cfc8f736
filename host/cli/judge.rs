//! `softdock judge`: finished runs judged by other criteria, metrics and requirements, without new runs.

use crate::args::JudgeArgs;
use crate::farm::end;
use crate::progress::Terminal;
use crate::words::{Exit, explain};
use softdock_campaign::Campaign;

/// Judges a results folder again.
pub(crate) fn judge(args: &JudgeArgs) -> miette::Result<Exit> {
    let load = |file: &std::path::PathBuf| Campaign::load_with(file, args.model.as_deref()).map_err(explain);
    let campaign = args.campaign.as_ref().map(load).transpose()?;
    end(softdock_farm::judge(&args.results, campaign, Terminal::new().context()), args.json)
}
