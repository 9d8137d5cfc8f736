//! Effects that the model of a bench may have and the loop has not: there they belong to a body's shape or are no error.

use super::{Effect, EffectBlock};

/// Their rows; the parameters are those of the bench's block.
pub const BENCH_EFFECTS: &[Effect] = &[
    of(
        "C8_dead_band",
        EffectBlock::Command,
        "servo",
        "dead band: static friction over the position gain",
        "servos without integral action, engineering judgement",
    ),
    of(
        "C9_position_offset",
        EffectBlock::Command,
        "servo",
        "static position error: load over the position gain",
        "servos without integral action, engineering judgement",
    ),
    of(
        "J20_encoder_delay",
        EffectBlock::Robot,
        "link encoder",
        "latency of the samples",
        "a cycle of 4 ms of a controller or of its recorder",
    ),
    of(
        "J21_base_tilt",
        EffectBlock::Robot,
        "base",
        "tilt against gravity",
        "a floor levelled to 2 mm per m, engineering judgement",
    ),
    of(
        "J22_axis_coupling",
        EffectBlock::Robot,
        "wrist",
        "motor that turns with the axis before its own",
        "inertia and friction of the motor itself",
    ),
    of("K11_shape", EffectBlock::Contact, "body", "size and radius of its corners", "callipers, 1 mm"),
    of(
        "K12_rolling",
        EffectBlock::Contact,
        "surface",
        "friction against rolling and spinning",
        "a lever of 1 mm, engineering judgement",
    ),
    of(
        "P6_gravity",
        EffectBlock::Space,
        "gravity",
        "free fall, by the scale of lengths and of time",
        "camera calibration, 2 %",
    ),
    of("P7_drag", EffectBlock::Space, "air", "drag", "a box of 1 dm and 1 kg at 1 m/s, 0.01 m/s^2"),
];

const fn of(
    id: &'static str,
    block: EffectBlock,
    component: &'static str,
    name: &'static str,
    source: &'static str,
) -> Effect {
    Effect { id, block, component, name, parameters: &[], source, groups: &["own"] }
}
