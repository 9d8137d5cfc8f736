//! Effects on the way of a command to the robots.

use super::{EffectParameter, Null, Row, at, row};

pub(super) const ROWS: &[Row] = &[
    row(
        "C1_transport_delay",
        &["G1"],
        "command path",
        "transport delay",
        &[EffectParameter { field: "loop_delay", null: Null::OwnDelay, scale: 0.016 }],
        "EPOS about 16 ms; EGM and RSI logs 40-120 ms",
    ),
    row(
        "C3_jitter",
        &["G9"],
        "command path",
        "transport jitter",
        &[at("delay_jitter", 0.001)],
        "0.25-2 ms on industrial command links",
    ),
    row(
        "C4_drops",
        &["G9"],
        "command path",
        "dropped packets",
        &[at("drop_probability", 0.01)],
        "engineering judgement",
    ),
    row(
        "C5_clock_skew",
        &["G1", "G8"],
        "clocks",
        "unequal rates: the delay grows with time",
        &[at("clock_skew", 1e-4)],
        "100 ppm between free-running crystals, engineering judgement",
    ),
    row(
        "C6_hold",
        &["G1"],
        "command path",
        "commands that are held, not interpolated",
        &[at("command_hold", 0.004)],
        "RSI's cycle of 4 ms",
    ),
    row(
        "C7_rate_limit",
        &["own"],
        "command path",
        "greatest speed of the tools",
        &[at("tool_speed_limit", 0.25), at("tool_rotation_limit", 1.0)],
        "0.25 m/s, the reduced speed of industrial robots; the rotation is engineering judgement",
    ),
];
