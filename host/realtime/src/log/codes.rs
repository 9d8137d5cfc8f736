//! The small vocabularies of the log: phase, cause of a stop, kind of an order, and what each flag bit says.

/// Declares an enumeration whose values stand in the log as numbers, with a word and a meaning each.
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
            /// All values; the position of each is its number in the log.
            pub const ALL: &[Self] = &[Self::$first, $(Self::$variant),*];
            /// The word of each value, as Parquet has it.
            pub const WORDS: &[&str] = &[$first_word, $($word),*];
            const MEANINGS: &[&str] = &[$first_meaning, $($meaning),*];

            /// The number in the log.
            pub const fn code(self) -> u32 {
                self as u32
            }

            /// The value of a number in the log; the first one for a number that this version does not know.
            pub fn from_code(code: u32) -> Self {
                Self::ALL.get(code as usize).copied().unwrap_or_default()
            }

            /// The word.
            pub const fn word(self) -> &'static str {
                Self::WORDS[self as usize]
            }

            /// What it means.
            pub const fn meaning(self) -> &'static str {
                Self::MEANINGS[self as usize]
            }
        }
    };
}

codes! {
    /// Where a drive is.
    Phase {
        StartUp "start_up" "links are opened and checked; nothing moves";
        ToStart "to_start" "the robots move to the start pose";
        Taring "taring" "the sensor is read at rest for its bias";
        Approach "approach" "the loop runs, the parts have not touched yet";
        Contact "contact" "the loop runs, the parts touch";
        Free "free" "the loop runs, the parts have touched and are apart again";
        Captured "captured" "the loop runs, the latch has closed";
        Stopping "stopping" "the controlled stop: a jerk-limited ramp";
        Stopped "stopped" "at rest, holding; the session is over";
        Ready "ready" "every check has passed; nothing moves before GO";
        Weighing "weighing" "robot 1 turns its tool, and the sensor weighs it in a second attitude";
        Retracting "retracting" "after a stop: robot 1 moves its part back along the approach";
    }
}

codes! {
    /// Why a drive stops.
    StopCause {
        None "none" "it does not";
        Completed "completed" "the run is over";
        Operator "operator" "the operator's stop key";
        Signal "signal" "SIGINT or SIGTERM";
        Panic "panic" "a part of the program failed";
        StartRefused "start_refused" "a check at start-up failed";
        LostPackets "lost_packets" "a robot's packets were lost for as many cycles as allowed";
        LinkSilent "link_silent" "a link is silent";
        LinkFault "link_fault" "a link cannot go on";
        RobotFault "robot_fault" "a robot reports a fault or has stopped following";
        SensorStale "sensor_stale" "the sensor's newest sample is too old";
        SensorFault "sensor_fault" "the sensor reports saturation or an error";
        ForceLimit "force_limit" "force or moment above its limit";
        ForceRate "force_rate" "force or moment changes faster than allowed";
        EnergyBudget "energy_budget" "the contact has created more energy than its budget";
        AxisLimit "axis_limit" "a command outside the limits of an axis";
        ToolLimit "tool_limit" "a command outside the tool's box or too far from the start";
        Tracking "tracking" "a robot is too far from its command";
        NonFinite "non_finite" "a number that is not finite";
        Overrun "overrun" "the cycle's work took too long";
        UntakenAnswers "untaken_answers" "a robot has not taken our answers for as many cycles as allowed";
        LossBudget "loss_budget" "too many lost reports and answers of a robot within the window";
        SetPoint "set_point" "a robot follows set-points that nobody here has sent";
        BlindSensor "blind_sensor" "the parts overlap and the sensor feels nothing";
        FreeForce "free_force" "the sensor feels a force and the parts are apart";
        CatchUp "catch_up" "a robot that has missed commands does not come back to them in time";
        Checked "checked" "the checks are done, as asked for; nothing has moved";
        Torque "torque" "torques of a robot that its weight and the measured force do not explain";
        Rate "rate" "a robot reports faster than in the cycle that its session began with";
        ToolSpeed "tool_speed" "a command of a tool faster than allowed";
        KeepOut "keep_out" "a command of a link or a tool into a keep-out box";
        ArmDistance "arm_distance" "a command that brings the arms too near each other";
        Singularity "singularity" "a command too near a singular posture";
    }
}

codes! {
    /// What a robot was told in a cycle.
    OrderKind {
        None "none" "nothing was sent";
        Hold "hold" "ask for no motion";
        Move "move" "be there at the end of the cycle";
        End "end" "stay there and end the session";
    }
}

codes! {
    /// A limit that a command can meet; with the axis, a bit of [`LimitFlags`](super::record::LimitFlags).
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

/// Bits of a cycle.
pub mod cycle_flags {
    /// Motion is armed: the real robots get the commands.
    pub const ARMED: u32 = 1;
    /// The cycle's work took longer than the cycle.
    pub const OVERRUN: u32 = 1 << 1;
    /// The latch is closed.
    pub const LATCHED: u32 = 1 << 2;
    /// A record of the log was lost right before this one.
    pub const AFTER_GAP: u32 = 1 << 3;
}

/// Bits of a robot in a cycle.
pub mod robot_flags {
    /// There is such a robot in this drive.
    pub const PRESENT: u32 = 1;
    /// A report came in this cycle; without it the last one stands.
    pub const FRESH: u32 = 1 << 1;
    /// The robot follows commands: drives on, no fault, no stop.
    pub const READY: u32 = 1 << 2;
    /// The robot tells the set-points that it follows.
    pub const ASKED: u32 = 1 << 3;
    /// The robot tells torques.
    pub const TORQUE: u32 = 1 << 4;
    /// The robot tells the pose of its tool.
    pub const POSE: u32 = 1 << 5;
}

/// Bits of a force/torque sensor in a cycle.
pub mod force_flags {
    /// There is such a sensor in this drive.
    pub const PRESENT: u32 = 1;
    /// A sample came since the last cycle.
    pub const FRESH: u32 = 1 << 1;
    /// The sensor says that the sample is beyond its range.
    pub const SATURATED: u32 = 1 << 2;
    /// The sensor says that the sample may not be used.
    pub const INVALID: u32 = 1 << 3;
}
