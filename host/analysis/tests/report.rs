//! The report page: every section is there, it opens offline, and odd campaigns do not break it.
//!
//! `SOFTDOCK_KEEP_RESULTS=DIR` leaves the made-up campaign and its page in DIR, to be looked at.

mod synthetic;

use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use serde_json::Value;
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
        plant: None,
        author_units: Vec::new(),
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

/// The text of a script element of the page.
fn element<'a>(page: &'a str, begin: &str) -> &'a str {
    let rest = page.split_once(begin).unwrap_or_else(|| panic!("no {begin}")).1;
    rest.split_once("</script>").expect("its end").0
}

/// Head and block of the page's data.
fn data(page: &str) -> (Value, Vec<u8>) {
    let head = element(page, "id=\"page-head\">");
    assert!(!head.contains('<'), "the head could end its element");
    let block = element(page, "id=\"page-block\">");
    let compressed = base64::engine::general_purpose::STANDARD.decode(block).unwrap();
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(compressed.as_slice()).read_to_end(&mut bytes).unwrap();
    (serde_json::from_str(head).unwrap(), bytes)
}

/// Eight-byte numbers of the block.
fn whole(place: &Value, block: &[u8]) -> Vec<u64> {
    assert_eq!(place["kind"], "f64");
    let [offset, length] = ["offset", "length"].map(|key| place[key].as_u64().unwrap() as usize);
    let numbers = block[offset..offset + 8 * length].chunks(8);
    numbers.map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()) as u64).collect()
}

/// The page without its scripts and their data.
fn markup(page: &str) -> String {
    let pieces = page.split("<script");
    pieces.map(|piece| piece.split_once("</script>").map_or(piece, |(_, rest)| rest)).collect()
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
        "Why runs do not pass the task",
        "session aborted",
        "3. Runs",
        "4. Margins",
        "5. Success against each dispersed input",
        "6. Energy injected by the facility",
        "7. Time histories and replay",
        "8. Dispersions",
        "9. Run accounting",
        "10. Numerics",
        "11. Configuration and how to reproduce",
        "Statement of compliance and signatures",
    ] {
        assert!(page.contains(section), "no section {section}");
    }
    let (head, block) = data(&page);
    let count = |key: &str| head[key].as_array().unwrap().len();
    assert_eq!((count("requirements"), count("curves"), count("traces")), (2, 6, 5));
    assert!(head["requirements"].as_array().unwrap().iter().all(|own| own["histogram"].is_object()));
    for curve in head["curves"].as_array().unwrap() {
        assert_eq!(whole(&curve["runs"], &block).iter().sum::<u64>(), RUNS, "curves are of all runs");
    }
    let markup = markup(&page);
    for remote in ["http:", "https:", "src=", "@import", "url(", "<link"] {
        assert!(!markup.contains(remote), "the page refers to {remote}");
    }
    assert!(markup.matches("href=\"").count() == markup.matches("href=\"#").count(), "a link leaves the page");
    assert!(page.contains("default-src 'none'; script-src 'sha256-"));
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
    assert!(empty.contains("8 of 8 shards are missing") && !empty.contains("page-head\">"));
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
    let (head, _) = data(&page);
    assert!(head["requirements"][0]["histogram"].is_null() && head["requirements"][1]["histogram"].is_object());
}

#[test]
fn large_campaign_is_sampled_in_strata_and_counted_whole() {
    const MANY: u64 = 12_000;
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    write_shards(results.path(), MANY, 0..24);
    let (page, summary) = page(results.path(), &requirements, MANY);
    let (head, block) = data(&page);
    let runs = whole(&head["run"], &block);
    assert!(runs.len() < MANY as usize / 2, "{} runs are no sample", runs.len());
    assert!(runs.is_sorted_by(|one, two| one < two), "each run once");
    assert_eq!((head["runs"].as_u64(), head["shown"].as_u64()), (Some(MANY), Some(runs.len() as u64)));
    let stratum = |id: &str| {
        let strata = head["strata"].as_array().unwrap();
        let own = strata.iter().find(|own| own["id"] == id).unwrap();
        ["total", "shown"].map(|key| own[key].as_u64().unwrap())
    };
    let agreement = &summary.agreement;
    let aborted = agreement.aborted_pass.count + agreement.aborted_fail.count;
    assert_eq!(stratum("false_fail")[0], agreement.false_fail.count);
    assert_eq!(stratum("aborted")[0], aborted);
    assert_eq!(stratum("invalid"), [agreement.invalid.count; 2], "rare runs are all shown");
    assert_eq!(stratum("false_pass"), [agreement.false_pass.count; 2], "rare runs are all shown");
    assert!(stratum("true_pass")[1] < stratum("true_pass")[0]);
    for requirement in &summary.requirements {
        for side in [&requirement.loops.space, &requirement.loops.facility] {
            assert!(runs.contains(&side.worst.unwrap().run), "the worst run of {}", requirement.id);
        }
    }
    for curve in head["curves"].as_array().unwrap() {
        assert_eq!(whole(&curve["runs"], &block).iter().sum::<u64>(), MANY);
    }
    let histogram = &head["requirements"][0]["histogram"];
    let sum = |key: &str| histogram[key].as_array().unwrap()[0].as_u64().unwrap();
    let bars: u64 = histogram["bars"][0].as_array().unwrap().iter().map(|bar| bar.as_u64().unwrap()).sum();
    assert_eq!(bars + sum("below") + sum("above") + sum("missing"), MANY);
}

#[test]
fn names_of_users_are_text_in_markup_and_data() {
    const EVIL: &str = "</script><script>run()</script><img src=x onerror=run()>";
    let (results, mut requirements) = (tempfile::tempdir().unwrap(), requirements());
    write_campaign(results.path(), RUNS);
    requirements[0].text = EVIL.to_owned();
    let content = Content::read(results.path(), &facts(&requirements, RUNS)).unwrap();
    let facts = softdock_analysis::CampaignFacts { title: EVIL, text: EVIL, ..facts(&requirements, RUNS) };
    let summary = summarise(&content, &facts).unwrap();
    let mut input = ReportInput { campaign: facts, ..input(&content, &requirements, RUNS) };
    for dispersion in &mut input.dispersions {
        dispersion.source = EVIL.to_owned();
        dispersion.target = EVIL.to_owned();
    }
    let page = std::fs::read_to_string(write_report(&input, &summary).unwrap()).unwrap();
    assert_eq!(page.matches("<script").count(), 3, "head, block and the page's own script");
    assert_eq!(page.matches("</script").count(), 3);
    assert!(!markup(&page).contains("<img"));
    let (head, _) = data(&page);
    assert_eq!(head["requirements"][0]["text"], EVIL);
}

/// The scripts state the hash of their sources.
#[test]
fn scripts_of_the_pages_are_built_from_their_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut names = vec!["package-lock.json".to_owned(), "build.mjs".to_owned()];
    for file in std::fs::read_dir(folder.join("page/src")).unwrap() {
        names.push(format!("src/{}", file.unwrap().file_name().to_str().unwrap()));
    }
    names.sort();
    let mut hash = blake3::Hasher::new();
    for name in names {
        let text = std::fs::read(folder.join("page").join(&name)).unwrap();
        hash.update(format!("{name}\n{}\n", text.len()).as_bytes()).update(&text);
    }
    let hash = hash.finalize().to_hex();
    for name in ["app.js", "shell.js"] {
        let script = std::fs::read_to_string(folder.join("src/page").join(name)).unwrap();
        let first = script.lines().next().unwrap();
        assert!(first.contains(hash.as_str()), "{name} is stale: run npm ci && npm run build in host/analysis/page");
        assert!(!script.to_lowercase().contains("</script"), "{name} would end its own element");
    }
}

/// Peak of the resident memory since the last call \[bytes\].
#[cfg(target_os = "linux")]
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap();
    let kilobytes: u64 = line.split_ascii_whitespace().nth(1).unwrap().parse().unwrap();
    std::fs::write("/proc/self/clear_refs", "5").unwrap();
    1_024 * kilobytes
}

/// Writes a gigabyte and takes minutes.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "slow: a million runs"]
fn page_of_a_million_runs_is_small_and_takes_bounded_memory() {
    const MILLION: u64 = 1_000_000;
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    write_campaign(results.path(), MILLION);
    peak_memory();
    let begun = std::time::Instant::now();
    let content = Content::read(results.path(), &facts(&requirements, MILLION)).unwrap();
    let read = begun.elapsed();
    let summary = summarise(&content, &facts(&requirements, MILLION)).unwrap();
    let summarised = begun.elapsed();
    let before = peak_memory();
    let path = write_report(&input(&content, &requirements, MILLION), &summary).unwrap();
    let (written, memory) = (begun.elapsed(), peak_memory());
    let page = std::fs::read_to_string(&path).unwrap();
    let (head, block) = data(&page);
    println!(
        "verified after {read:.1?}, summary after {summarised:.1?}, page after {written:.1?}; peak memory {} MB before the page, {} MB \
         with it; page {} bytes, {} runs shown",
        before >> 20,
        memory >> 20,
        page.len(),
        head["shown"]
    );
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    assert!(memory < 1 << 30, "{memory} bytes");
    for curve in head["curves"].as_array().unwrap() {
        assert_eq!(whole(&curve["runs"], &block).iter().sum::<u64>(), MILLION);
    }
    if let Ok(kept) = std::env::var("SOFTDOCK_KEEP_RESULTS") {
        std::fs::copy(&path, Path::new(&kept).join("report.html")).unwrap();
    }
}
