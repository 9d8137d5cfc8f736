//! Sessions of a facility that determine the effects which logs of drives do not show.

/// Effects, with the session of a facility that determines them.
pub(super) struct SessionRow {
    /// Catalogue ids.
    pub(super) ids: &'static [&'static str],
    /// The session.
    pub(super) session: &'static str,
}

/// All rows.
pub(super) const SESSIONS: [SessionRow; 7] = [
    SessionRow {
        ids: &["P1_mass", "P2_slosh", "P3_appendage"],
        session: "drive a run while a known weight pulls part A over a pulley: the simulated acceleration in the log \
                  against force over mass",
    },
    SessionRow {
        ids: &["C3_jitter", "C4_drops"],
        session: "drive one run five times (`softdock drive CAMPAIGN --run N --repeat 1` to `5`) and compare the motions; the \
                  lost and late packets of each link are in the log",
    },
    SessionRow {
        ids: &["S1_bias", "S9_tare"],
        session: "read the sensor at rest in six poses before and after a drive: each drive is tared on its own, so that \
                  its log holds no bias",
    },
    SessionRow {
        ids: &["S8_load"],
        session: "read the sensor at rest in six poses with part A mounted, with a model that has the load behind the \
                  sensor",
    },
    SessionRow {
        ids: &["S6_quantisation"],
        session: "press slowly through a few newtons and look at the steps of the raw force",
    },
    SessionRow {
        ids: &["S7_noise"],
        session: "record the sensor for ten seconds with the robots at rest, brakes on and off",
    },
    SessionRow {
        ids: &["C2_lag", "C7_rate_limit"],
        session: "a sine of the tools in free space, as in campaigns/facility_sine.toml, at three frequencies and up to \
                  the speed limit",
    },
];

/// Returns the session that determines an effect.
pub(super) fn session(id: &str) -> Option<&'static str> {
    SESSIONS.iter().find(|row| row.ids.contains(&id)).map(|row| row.session)
}
