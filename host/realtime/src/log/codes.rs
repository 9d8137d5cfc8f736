//! Enumerations and flags of the log: phase, cause of a stop, kind of a command, flag bits.

/// Declares an enumeration with the number, word and meaning of each value in the log.
macro_rules! codes {
    ($(#[$doc:meta])* $name:ident {
        $first:ident $first_word:literal $first_meaning:literal;
        $($variant:ident $word:literal $meaning:literal;)*
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[repr(u32)]
        pub enum $name {
            #[doc = $first_meaning]
            #[default]
            $first,
            $(#[doc = $meaning] $variant,)*
        }

        impl $name {
            /// All values; the index of each is its number in the log.
            pub const ALL: &[Self] = &[Self::$first, $(Self::$variant),*];
            /// The word of each value in Parquet.
            pub const WORDS: &[&str] = &[$first_word, $($word),*];
            const MEANINGS: &[&str] = &[$first_meaning, $($meaning),*];

            /// Returns the number in the log.
            pub const fn code(self) -> u32 {
                self as u32
            }

            /// Returns the value of a number in the log; the first one for numbers unknown to this version.
            pub fn from_code(code: u32) -> Self {
                Self::ALL.get(code as usize).copied().unwrap_or_default()
            }

            /// Returns the word.
            pub const fn word(self) -> &'static str {
                Self::WORDS[self as usize]
            }

            /// Returns the meaning.
            pub const fn meaning(self) -> &'static str {
                Self::MEANINGS[self as usize]
            }
        }
    };
}

codes! {
    /// Phase of a session.
    Phase {
        StartUp "start_up" "links are opened and checked; nothing moves";
        ToStart "to_start" "the robots move to the start pose";
        Taring "taring" "the sensor is read at rest for its bias";
        Approach "approach" "the loop runs, the parts have not touched yet";
        Contact "contact" "the loop runs, the parts touch";
        Free "free" "the loop runs, the parts have touched and are separated again";
        Captured "captured" "the loop runs, the latch has closed";
        Stopping "stopping" "the controlled stop: a jerk-limited ramp";
        Stopped "stopped" "at rest, holding; the session is over";
        Ready "ready" "every check has passed; waiting for GO";
        Weighing "weighing" "robot 1 turns its tool for weighing in a second attitude";
        Retracting "retracting" "after a stop: robot 1 retracts its part along the approach";
    }
}

codes! {
    /// Cause of a stop.
    StopCause {
        None "none" "no stop";
        Completed "completed" "the run is over";
        Operator "operator" "the operator's stop key";
        Signal "signal" "SIGINT or SIGTERM";
        Panic "panic" "a part of the program failed";
        StartRefused "start_refused" "a check at start-up failed";
        LostPackets "lost_packets" "a robot's packets were lost for more cycles than allowed";
        LinkSilent "link_silent" "a link is silent";
        LinkFault "link_fault" "a link has failed";
        RobotFault "robot_fault" "a robot reports a fault or has stopped following";
        SensorStale "sensor_stale" "the sensor's newest sample is too old";
        SensorFault "sensor_fault" "the sensor reports saturation or an error";
        ForceLimit "force_limit" "force or moment above its limit";
        ForceRate "force_rate" "force or moment changes faster than allowed";
        EnergyBudget "energy_budget" "the facility has injected more energy than its budget";
        AxisLimit "axis_limit" "a command outside the limits of an axis";
        ToolLimit "tool_limit" "a command outside the tool's box or too far from the start";
        Tracking "tracking" "a robot is too far from its command";
        NonFinite "non_finite" "a number that is not finite";
        Overrun "overrun" "the cycle's work took too long";
        UntakenAnswers "untaken_answers" "a robot has not taken our answers for more cycles than allowed";
        LossBudget "loss_budget" "too many lost reports and answers of a robot within the window";
        SetPoint "set_point" "a robot follows set-points that this machine has not sent";
        BlindSensor "blind_sensor" "the parts overlap and the sensor measures no force";
        FreeForce "free_force" "the sensor measures a force and the parts are separated";
        CatchUp "catch_up" "a robot that has missed commands does not return to them in time";
        Checked "checked" "the requested checks are done; nothing has moved";
        Torque "torque" "weight and measured force do not explain a robot's torques";
        Rate "rate" "a robot reports in a shorter cycle than at the start of its session";
        ToolSpeed "tool_speed" "a command of a tool faster than allowed";
        KeepOut "keep_out" "a command of a link or a tool into a keep-out box";
        ArmDistance "arm_distance" "a command that brings the arms too near each other";
        Singularity "singularity" "a command too near a singular posture";
    }
}

codes! {
    /// Kind of a robot's command in a cycle.
    OrderKind {
        None "none" "nothing was sent";
        Hold "hold" "no motion";
        Move "move" "position at the end of the cycle";
        End "end" "hold and end the session";
    }
}

codes! {
    /// A limit that clamps a command; with the axis, a bit of [`LimitFlags`](super::record::LimitFlags).
    LimitKind {
        Position "position" "position window";
        Velocity "velocity" "velocity";
        Acceleration "acceleration" "acceleration";
        Jerk "jerk" "jerk";
        Box "box" "box of the tool centre point";
        Offset "offset" "distance from the start";
        Tracking "tracking" "distance between command and measurement";
        NonFinite "non_finite" "not a finite number";
    }
}

/// Flag bits of a cycle.
pub mod cycle_flags {
    /// Armed: the commands move real robots.
    pub const ARMED: u32 = 1;
    /// The cycle's work took longer than the cycle.
    pub const OVERRUN: u32 = 1 << 1;
    /// The latch is closed.
    pub const LATCHED: u32 = 1 << 2;
    /// A record of the log was lost right before this one.
    pub const AFTER_GAP: u32 = 1 << 3;
}

/// Flag bits of a robot in a cycle.
pub mod robot_flags {
    /// The robot exists in this session.
    pub const PRESENT: u32 = 1;
    /// A report arrived in this cycle; without it the last one is repeated.
    pub const FRESH: u32 = 1 << 1;
    /// The robot follows commands: drives on, no fault, no stop.
    pub const READY: u32 = 1 << 2;
    /// The robot reports its set-points.
    pub const ASKED: u32 = 1 << 3;
    /// The robot reports torques.
    pub const TORQUE: u32 = 1 << 4;
    /// The robot reports the pose of its tool.
    pub const POSE: u32 = 1 << 5;
}

/// Flag bits of a force/torque sensor in a cycle.
pub mod force_flags {
    /// The sensor exists in this session.
    pub const PRESENT: u32 = 1;
    /// A sample arrived since the last cycle.
    pub const FRESH: u32 = 1 << 1;
    /// The sensor reports saturation.
    pub const SATURATED: u32 = 1 << 2;
    /// The sensor reports that the sample is not usable.
    pub const INVALID: u32 = 1 << 3;
}
