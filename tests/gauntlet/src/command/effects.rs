//! Hidden effects of the command rig, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("C1_transport_delay", ("delay", 0.003, "s"), "received T later than in the model"),
    EffectCase::growing("C2_lag", ("time_constant", 0.003, "s"), "1/(T s + 1) on the command"),
    EffectCase::growing("C3_jitter", ("deviation", 0.0005, "s"), "normal delay, independent from tick to tick")
        .up_to(0.002),
    EffectCase::growing("C4_drops", ("probability", 0.01, ""), "packet lost, the last one held").up_to(0.5),
    EffectCase::growing("C5_skew", ("skew", 0.0003, ""), "delay that grows by a share of the time").up_to(0.01),
    EffectCase::growing("C6_hold", ("period", 0.004, "s"), "command held over a period"),
    EffectCase::limit("C7_rate_limit", ("rate", 0.5, "rad/s"), "|d command/dt| <= rate"),
];

/// Forms outside the catalogue.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing("long_tail_jitter", ("scale", 0.0002, "s"), "Pareto delay with exponent 1.5: rare and long")
        .up_to(0.002),
    EffectCase::growing("rate_dependent_delay", ("delay", 0.003, "s"), "received T |d command/dt| / (1 rad/s) later")
        .up_to(0.02),
    EffectCase::growing(
        "beating_delay",
        ("delay", 0.004, "s"),
        "delay that rises from 0 to T and falls back, every 0.7 s",
    ),
];
