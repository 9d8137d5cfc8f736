//! `softdock check`: reads a campaign, draws its inputs, steps the nominal case, reports what its runs can prove.

use crate::args::{BackendArg, CheckArgs};
use crate::farm::called;
use crate::progress::Terminal;
use crate::scene::draw_scene;
use crate::words::{Exit, explain, json, say};
use softdock_campaign::Campaign;
use softdock_farm::check::{check_json, check_text};
use softdock_farm::{choice_of, step::step};

/// Checks a campaign.
pub(crate) fn check(args: &CheckArgs) -> miette::Result<Exit> {
    let campaign = Campaign::load_with(&args.campaign, args.model.as_deref()).map_err(explain)?;
    if let Some(path) = &args.scene {
        draw_scene(&campaign, path)?;
    }
    let choice = args.backend.map_or_else(|| choice_of(&campaign), BackendArg::choice);
    let stepped = called(step(&campaign, args.step, choice, Terminal::new().context()))?;
    match args.json {
        true => {
            let mut answer = check_json(&campaign, args.runs);
            answer["stepped"] = stepped.json();
            say(json(&answer));
        }
        false => say(check_text(&campaign, args.runs) + &stepped.text()),
    }
    Ok(Exit::Done)
}
