//! Properties of a plan: unique names, seeds, numbers of draws, shards.

use super::*;
use std::collections::BTreeSet;

fn full(plants: &[&str]) -> Vec<Case> {
    of_machine(MachineKind::Exact, plants)
}

fn of_machine(machine: MachineKind, plants: &[&str]) -> Vec<Case> {
    let plants = plants.iter().map(|name| (*name).to_owned()).collect();
    plan(&WantedCases { extent: Extent::Full, machine, plants, draws: None }).expect("plants that there are")
}

#[test]
fn perturbed_cases_share_neither_name_nor_seed_with_exact_ones() {
    let (exact, perturbed) = (full(&["drive"]), of_machine(MachineKind::Perturbed, &["drive"]));
    let seeds = |cases: &[Case]| cases.iter().map(Case::seed).collect::<BTreeSet<u64>>();
    let ids = |cases: &[Case]| cases.iter().map(Case::id).collect::<BTreeSet<String>>();
    assert!(seeds(&exact).is_disjoint(&seeds(&perturbed)) && ids(&exact).is_disjoint(&ids(&perturbed)));
    assert!(ids(&perturbed).iter().all(|id| id.starts_with("drive.perturbed.")));
    assert!(perturbed.iter().all(|case| case.task == CaseTask::Null || case.multiple == 4.0));
}

#[test]
fn case_ids_are_unique_and_a_quick_plant_has_300_nulls() {
    let cases = full(&[]);
    let ids: BTreeSet<String> = cases.iter().map(Case::id).collect();
    assert_eq!(ids.len(), cases.len());
    assert!(ids.iter().all(|id| id.chars().all(|c| c.is_ascii_alphanumeric() || "._+".contains(c))), "{ids:?}");
    let nulls = cases.iter().filter(|case| case.task == CaseTask::Null && case.plant.name == "drive");
    let colours = NoiseColour::ALL.map(|colour| nulls.clone().filter(|case| case.noise == colour).count());
    assert_eq!(colours, [100; 3]);
}

#[test]
fn slow_plant_has_four_draws_of_detectable_effects() {
    let cases = full(&["facility"]);
    let draws =
        |task: &dyn Fn(&CaseTask) -> bool| cases.iter().filter(|case| task(&case.task)).map(|case| case.draw).max();
    assert_eq!(draws(&|task| matches!(task, CaseTask::Effect(_))), Some(3));
    assert_eq!(draws(&|task| *task == CaseTask::Null), Some(11));
    assert!(cases.iter().all(|case| case.task == CaseTask::Null || [4.0, 16.0].contains(&case.multiple)));
}

#[test]
fn shards_share_the_plan_and_keep_a_seed_together() {
    let cases = full(&["drive"]);
    let shards: Vec<Vec<Case>> = (1..=3).map(|number| shard(cases.clone(), number, 3)).collect();
    let ids: BTreeSet<String> = shards.iter().flatten().map(Case::id).collect();
    assert_eq!((ids.len(), shards.iter().map(Vec::len).sum::<usize>()), (cases.len(), cases.len()));
    let seeds = |cases: &Vec<Case>| cases.iter().map(Case::seed).collect::<BTreeSet<u64>>();
    assert!(seeds(&shards[0]).is_disjoint(&seeds(&shards[1])));
}

#[test]
fn paired_effects_share_no_group() {
    let pairs = pairs(&PLANTS[0], PAIRS);
    assert_eq!(pairs.len(), PAIRS);
    assert!(pairs.iter().all(|(a, b)| !share_group(a.id, b.id)));
}

#[test]
fn unknown_plant_is_rejected_with_the_list_of_plants() {
    let wanted =
        WantedCases { extent: Extent::Ci, machine: MachineKind::Exact, plants: vec!["wheel".to_owned()], draws: None };
    let message = plan(&wanted).expect_err("no such plant").to_string();
    assert!(message.contains("wheel") && message.contains("drive"), "{message}");
}
