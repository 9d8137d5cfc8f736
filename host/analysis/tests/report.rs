//! The report page: every section is there, it opens offline, and odd campaigns do not break it.
//!
//! `SOFTDOCK_KEEP_RESULTS=DIR` leaves the made-up campaign and its page in DIR, to be looked at.

mod synthetic;

use std::path::{Path, PathBuf};

use softdock_analysis::{
    Content, Fact, ReportInput, ReportedDispersion, Summary, summarise, write_report, write_summary,
};
use softdock_campaign::requirement::Requirement;
use softdock_results::shards::write_shard;
use synthetic::{facts, provenance, requirements, row, schema, write_campaign, write_shards};

const RUNS: u64 = 4_000;

fn input<'a>(content: &'a Content, requirements: &'a [Requirement], runs: u64) -> ReportInput<'a> {
    let dispersion = |column: &str, distribution: &str, class: &str, source: &str| ReportedDispersion {
        target: column.strip_prefix("in_").unwrap_or(column).to_owned(),
        column: column.to_owned(),
        distribution: distribution.to_owned(),
        class: class.to_owned(),
        source: source.to_owned(),
    };
    let fact = |name: &str, value: &str| Fact { name: name.to_owned(), value: value.to_owned() };
    ReportInput {
        criteria: vec!["the latch closes".to_owned()],
        rules: vec!["energy injected by the facility above 30 J".to_owned()],
        campaign: facts(requirements, runs),
        content,
        outcome_maps: &[],
        dispersions: vec![
            dispersion("in_closing_speed_m_per_s", "uniform 0.02 m/s to 0.08 m/s", "aleatory", "IDSS-like"),
            dispersion("in_loop_delay_s", "uniform 4 ms to 40 ms", "epistemic", "facility log"),
            dispersion("in_contact_stiffness_n_per_m", "log-uniform 5 kN/m to 100 kN/m", "epistemic", "estimate"),
            dispersion("in_contact_friction", "uniform 0.05 to 0.4", "epistemic", "tribology <vacuum> & air"),
            dispersion("in_target_mass_kg", "uniform 400 kg to 2000 kg", "aleatory", "mass budget"),
            dispersion("in_offset_y_m", "sum of three uniforms", "aleatory", ""),
        ],
        configuration: vec![fact("scenario", "probe_drogue"), fact("substep", "0.25 ms")],
        commands: vec![
            "softdock run campaigns/probe_drogue.toml".to_owned(),
            "softdock replay results/x 12".to_owned(),
        ],
    }
}

fn page(results: &Path, requirements: &[Requirement], runs: u64) -> (String, Summary) {
    let content = Content::read(results, &facts(requirements, runs)).unwrap();
    let summary = summarise(&content, &facts(requirements, runs)).unwrap();
    let path = write_report(&input(&content, requirements, runs), &summary).unwrap();
    (std::fs::read_to_string(path).unwrap(), summary)
}

#[test]
fn page_has_every_section_and_figure_and_needs_no_network() {
    let (temporary, requirements) = (tempfile::tempdir().unwrap(), requirements());
    let kept = std::env::var("SOFTDOCK_KEEP_RESULTS").map(PathBuf::from);
    let results = kept.unwrap_or(temporary.path().to_owned());
    write_campaign(&results, RUNS);
    let (page, summary) = page(&results, &requirements, RUNS);
    for section in [
        "1. Requirements",
        "2. Agreement of the facility with space",
        "3. Margins",
        "4. Success against each dispersed input",
        "5. Energy injected by the facility",
        "Why runs do not pass the task",
        "session aborted",
        "6. Forces over time",
        "7. Dispersions",
        "8. Run accounting",
        "9. Numerics",
        "10. Configuration and how to reproduce",
        "Statement of compliance and signatures",
    ] {
        assert!(page.contains(section), "no section {section}");
    }
    // Two margin figures for each of two requirements, six inputs, the energies and five traces.
    assert_eq!(page.matches("<svg ").count(), 4 + 6 + 1 + 5);
    for remote in ["http:", "https:", "src=", "href=", "@import", "url(", "<script", "<link"] {
        assert!(!page.contains(remote), "the page refers to {remote}");
    }
    assert!(page.contains("tribology &lt;vacuum&gt; &amp; air"), "text is not escaped");
    assert!(page.contains("50 runs were repeated at half the substep. In 0 of them a verdict differs"));
    assert!(page.contains("100 runs were repeated in f64. In 2 of them a verdict differs"));
    assert!(page.contains("In 1 of these the facility's loop diverged in only one of the two"));
    assert!(page.contains("✗ Not verified") && page.contains("✓ Verified"));
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    let path = write_summary(&results, &summary).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    assert_eq!((&json["schema"], &json["exit_code"]), (&"summary/3".into(), &1.into()));
}

#[test]
fn the_same_results_give_the_same_page() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    write_campaign(results.path(), RUNS);
    let [one, two] = [0, 1].map(|_| page(results.path(), &requirements, RUNS).0);
    assert!(one == two);
}

#[test]
fn incomplete_or_empty_campaign_has_a_page() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    let (empty, _) = page(results.path(), &requirements, RUNS);
    assert!(empty.contains("8 of 8 shards are missing"));
    write_shards(results.path(), RUNS, 0..1);
    let (partial, _) = page(results.path(), &requirements, RUNS);
    assert!(partial.contains("7 of 8 shards are missing") && partial.contains("Missing shards: 1, 2, 3"));
    assert!(partial.contains("The campaign records no traces") && partial.contains("parity table absent"));
}

#[test]
fn a_requirement_on_success_has_counts_instead_of_a_histogram() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    let success = |run: u64| {
        let mut row = row(run);
        for outcomes in [&mut row.space.requirements, &mut row.hil.requirements] {
            outcomes[0].margin = outcomes[0].pass.map(|pass| f64::from(u8::from(pass)) - 1.0);
        }
        row
    };
    write_shard(results.path(), 0, &schema(), (0..500).map(success).collect(), &provenance()).unwrap();
    let (page, _) = page(results.path(), &requirements, 500);
    assert_eq!(page.matches("The margin takes fewer than three values").count(), 1);
    assert_eq!(page.matches("<svg ").count(), 2 + 6 + 1);
}

#[test]
fn large_campaign_is_thinned_in_figures_and_reports_it() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    // A plan of more runs than figures hold; the shards at hand are enough to see the stride.
    write_shards(results.path(), 250_000, 0..4);
    let (page, summary) = page(results.path(), &requirements, 250_000);
    assert_eq!(summary.accounting.runs(), 2_000);
    assert!(page.contains("Figures show one run in 3 (667 runs)"), "no word of thinning");
}
