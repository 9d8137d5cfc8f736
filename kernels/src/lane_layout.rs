//! What a lane keeps between two slices: which numbers there are, by name.

use crate::effects::EffectId;
use crate::model::CompensatorKind;
use crate::plant::Plant;

/// Whether a facility has a compensator at all: without one a lane's state has no numbers of it.
pub fn compensates(plant: &Plant) -> bool {
    plant.facility.compensator.kind != CompensatorKind::None
}

/// Variables of the bristles of so many contact points: of the loop in space, then of the facility's.
pub fn bristle_names(points: usize) -> Vec<String> {
    let of = |side: &'static str| (0..points).map(move |i| format!("{side}_bristle_{i}"));
    of("space").chain(of("hil")).collect()
}

/// Whether a member of the state can differ from zero; a member of an absent effect is not kept between slices.
pub fn moves(plant: &Plant, member: &str) -> bool {
    let by = |id: EffectId| plant.effects.has(id);
    match member {
        _ if member.starts_with("sway_0_") => by(EffectId::of("P2_slosh")),
        _ if member.starts_with("sway_1_") => by(EffectId::of("P3_appendage")),
        _ if member.starts_with("fixture_") => by(EffectId::of("K10_fixture")),
        _ if member.starts_with("axis_") && member.ends_with("_cable") => by(EffectId::of("J17_cable_drag")),
        "age" | "cold" => by(EffectId::of("J6_temperature")),
        _ => true,
    }
}
