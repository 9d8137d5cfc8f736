//! Effects that the model of a bench may have and the loop has not: there they belong to a body's shape or are no error.

use super::{Effect, EffectBlock};

/// Their rows; the parameters are those of the bench's block.
pub const BENCH_EFFECTS: &[Effect] = &[
    of(
        "C8_dead_band",
        EffectBlock::Command,
        "dead band of a servo: static friction over its position gain",
        "servos without integral action, engineering judgement",
    ),
    of(
        "C9_position_offset",
        EffectBlock::Command,
        "error in which a servo settles: its load over its position gain",
        "servos without integral action, engineering judgement",
    ),
    of(
        "J20_encoder_delay",
        EffectBlock::Robot,
        "age of the samples of the encoder behind the gear",
        "a cycle of 4 ms of a controller or of its recorder",
    ),
    of(
        "J21_base_tilt",
        EffectBlock::Robot,
        "tilt of the robot's base against gravity",
        "a floor levelled to 2 mm per m, engineering judgement",
    ),
    of(
        "J22_axis_coupling",
        EffectBlock::Robot,
        "motor that turns with the axis before its own, as in wrists",
        "inertia and friction of the motor itself",
    ),
    of("K11_shape", EffectBlock::Contact, "size of the body and radius of its corners", "callipers, 1 mm"),
    of(
        "K12_rolling",
        EffectBlock::Contact,
        "friction against rolling and spinning",
        "a lever of 1 mm, engineering judgement",
    ),
    of("P6_gravity", EffectBlock::Space, "free fall, by the scale of lengths and of time", "camera calibration, 2 %"),
    of("P7_drag", EffectBlock::Space, "drag of the air", "a box of 1 dm and 1 kg at 1 m/s, 0.01 m/s^2"),
];

const fn of(id: &'static str, block: EffectBlock, name: &'static str, source: &'static str) -> Effect {
    Effect { id, block, name, parameters: &[], source, group: "own" }
}
