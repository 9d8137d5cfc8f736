//! The shipped campaigns, and the statistics of whole draws.

use crate::campaign::Keep;
use crate::{Campaign, histograms, json_schema, load, scenario_json_schema};
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::params::Params;
use std::path::{Path, PathBuf};

fn campaigns() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns")
}

fn shipped(name: &str) -> Campaign {
    load(&campaigns().join(name)).unwrap_or_else(|problems| panic!("{problems}"))
}

#[test]
fn shipped_campaigns_are_valid_and_described() {
    for (name, runs) in [("smoke.toml", 64), ("plate_impact.toml", 4000), ("probe_drogue.toml", 2000)] {
        let campaign = shipped(name);
        assert_eq!(campaign.runs, runs);
        assert_eq!(campaign.hash.len(), 64);
        let text = histograms(&campaign, 500);
        println!("{text}");
        for dispersion in &campaign.dispersions {
            assert!(text.contains(&dispersion.name), "{name}: {}", dispersion.name);
        }
        assert!(text.contains("C1_transport_delay"));
    }
}
