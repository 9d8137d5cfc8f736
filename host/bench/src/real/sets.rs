//! Sets of measured recordings with their models, and what is planted in them.

use crate::real::forms::{PlantedChange, TorqueForm};
use std::path::Path;

/// Effect that can be planted in a recording.
#[derive(Debug)]
pub struct PlantedForm {
    /// Id in the library of the diagnosis.
    pub id: &'static str,
    /// Parameter that states its size.
    pub field: &'static str,
    /// Whether the parameter is the model's value and the planted one together.
    pub on_nominal: bool,
    /// Change of the recording.
    pub change: PlantedChange,
}

/// Effect that is planted by a change of the model file.
#[derive(Debug)]
pub struct PlantedModel {
    /// Id in the library of the diagnosis.
    pub id: &'static str,
    /// Parameter that states its size.
    pub field: &'static str,
    /// Text of the model file and its replacement.
    pub replaced: [&'static str; 2],
    /// True value of the parameter, SI; `None` if only its name is compared.
    pub value: Option<f64>,
}

/// Joint of a set in which effects are planted.
#[derive(Debug)]
pub struct PlantedJoint {
    /// End of the names of its signals.
    pub end: &'static str,
    /// Block of the diagnosis; of a rig with one joint any.
    pub block: &'static str,
}

/// Measured recordings with a model.
#[derive(Debug)]
pub struct MeasuredSet {
    /// Name in case ids.
    pub name: &'static str,
    /// Folder below that of the measured data.
    pub folder: &'static str,
    /// Recordings to learn from.
    pub training: &'static [&'static str],
    /// Held-out recordings.
    pub holdout: &'static [&'static str],
    /// Time from which the training recordings are held out \[s\].
    pub hold_out_from: Option<f64>,
    /// Experiments that are held out, by their numbers.
    pub hold_out_experiments: Option<&'static str>,
    /// Model file.
    pub rig: &'static str,
    /// Files that the model file names.
    pub beside: &'static [(&'static str, &'static str)],
    /// Joints in which forms are planted.
    pub joints: &'static [PlantedJoint],
    /// Planted forms.
    pub forms: &'static [PlantedForm],
    /// Sizes of the forms.
    pub multiples: &'static [f64],
    /// Pairs of forms, by their places, planted together at the largest size.
    pub pairs: &'static [[usize; 2]],
    /// Effects planted in the model.
    pub models: &'static [PlantedModel],
    /// Whether equal steps between the samples may be made shorter by interpolation.
    pub continuous: bool,
    /// Whether rows may be dropped: a single event and impacts are gone with theirs.
    pub droppable: bool,
}

const fn torque(id: &'static str, field: &'static str, on_nominal: bool, form: TorqueForm) -> PlantedForm {
    PlantedForm { id, field, on_nominal, change: PlantedChange::Torque(form) }
}

const COULOMB: PlantedForm = torque("J1_coulomb", "coulomb", true, TorqueForm::Coulomb);
const GAIN: PlantedForm = torque("J11_torque_constant", "torque_constant_error", false, TorqueForm::Gain);
const CABLE: PlantedForm = torque("J17_cable_drag", "cable_stiffness", false, TorqueForm::Cable);
const DIRECTION: PlantedForm = torque("J18_drive_offset", "coulomb_asymmetry", false, TorqueForm::Direction);
const DELAY: PlantedForm =
    PlantedForm { id: "C1_transport_delay", field: "delay", on_nominal: false, change: PlantedChange::Delay };

/// Forms of a drive that turns; gravity is the last.
const TURNING: &[PlantedForm] = &[
    COULOMB,
    torque("J2_viscous", "viscous", true, TorqueForm::Viscous),
    torque("J3_stribeck", "stribeck", false, TorqueForm::Static),
    torque("J9_torque_ripple", "ripple_sin", false, TorqueForm::Ripple),
    GAIN,
    torque("J15_link_inertia", "inertia_error", false, TorqueForm::Inertia),
    CABLE,
    DIRECTION,
    torque("J18_drive_offset", "offset", false, TorqueForm::Offset),
    torque("J16_gravity_compensation", "gravity_cos", false, TorqueForm::Gravity),
];

/// Forms of a drive that slides: without gravity.
const SLIDING: &[PlantedForm] = TURNING.split_at(TURNING.len() - 1).0;

/// Pairs of both lists: friction with a spring, ripple with friction, inertia with friction, gain with ripple, spring with
/// ripple.
const PAIRS: &[[usize; 2]] = &[[0, 6], [1, 3], [5, 0], [4, 3], [6, 3]];

/// Forms of a servo.
const SERVO: &[PlantedForm] = &[DELAY];

const ONLY: &[PlantedJoint] = &[PlantedJoint { end: "", block: "" }];

const EMPTY: MeasuredSet = MeasuredSet {
    name: "",
    folder: "",
    training: &[],
    holdout: &[],
    hold_out_from: None,
    hold_out_experiments: None,
    rig: "",
    beside: &[],
    joints: ONLY,
    forms: &[],
    multiples: &[],
    pairs: &[],
    models: &[],
    continuous: false,
    droppable: true,
};

const KUKA: MeasuredSet = MeasuredSet {
    folder: "kuka-kr300-recordings",
    training: &["traj_A.csv"],
    holdout: &["traj_B.csv"],
    forms: TURNING,
    multiples: &[1.0, 2.0],
    pairs: PAIRS,
    continuous: true,
    ..EMPTY
};

const KUKA_ROBOT: MeasuredSet = MeasuredSet { pairs: &[], continuous: false, ..KUKA };

const UR10E: MeasuredSet = MeasuredSet {
    folder: "ur10e",
    training: &["identification_data__ur-20_02_10-30sec_12harm.csv"],
    holdout: &["identification_data__ur-20_01_31-unload.csv"],
    forms: TURNING,
    multiples: &[1.0, 2.0, 4.0],
    pairs: PAIRS,
    continuous: true,
    ..EMPTY
};

const SO101: MeasuredSet = MeasuredSet {
    folder: "so101",
    training: &["multisine.csv"],
    holdout: &["chirp_sweep.csv"],
    forms: SERVO,
    multiples: &[1.0, 2.0, 4.0, 8.0],
    ..EMPTY
};

/// All sets.
pub const SETS: &[MeasuredSet] = &[
    MeasuredSet {
        name: "emps",
        folder: "emps",
        training: &["emps_train.csv"],
        hold_out_from: Some(6.21),
        rig: include_str!("../../rigs/emps.toml"),
        forms: SLIDING,
        multiples: &[4.0, 8.0, 16.0],
        pairs: PAIRS,
        continuous: true,
        ..EMPTY
    },
    MeasuredSet { name: "kr300_axis4", rig: include_str!("../../rigs/kr300_axis4.toml"), ..KUKA },
    MeasuredSet { name: "kr300_axis6", rig: include_str!("../../rigs/kr300_axis6.toml"), ..KUKA },
    MeasuredSet { name: "kr300_axis5", rig: include_str!("../../rigs/kr300_axis5.toml"), ..KUKA },
    MeasuredSet { name: "ur10e_axis1", rig: include_str!("../../rigs/ur10e_axis1.toml"), ..UR10E },
    MeasuredSet { name: "ur10e_axis2", rig: include_str!("../../rigs/ur10e_axis2.toml"), ..UR10E },
    MeasuredSet {
        name: "so101_joint3",
        rig: include_str!("../../rigs/so101_joint3.toml"),
        models: &[
            PlantedModel {
                id: "C8_dead_band",
                field: "dead_band",
                replaced: ["dead_band = \"0.03824 rad\"", "dead_band = \"0.02824 rad\""],
                value: Some(0.01),
            },
            PlantedModel {
                id: "C8_dead_band",
                field: "dead_band",
                replaced: ["dead_band = \"0.03824 rad\"", "dead_band = \"0.01824 rad\""],
                value: Some(0.02),
            },
            PlantedModel {
                id: "C9_position_offset",
                field: "position_offset",
                replaced: ["position_offset = \"0.03484 rad\"", "position_offset = \"0.02484 rad\""],
                value: Some(0.01),
            },
            PlantedModel {
                id: "C9_position_offset",
                field: "position_offset",
                replaced: ["position_offset = \"0.03484 rad\"", "position_offset = \"0.01484 rad\""],
                value: Some(0.02),
            },
        ],
        ..SO101
    },
    MeasuredSet {
        name: "so101_joint4",
        rig: include_str!("../../rigs/so101_joint4.toml"),
        models: &[
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.1104 s\"", "lag = \"0.0904 s\""],
                value: Some(0.02),
            },
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.1104 s\"", "lag = \"0.0704 s\""],
                value: Some(0.04),
            },
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.1104 s\"", "lag = \"0.0304 s\""],
                value: Some(0.08),
            },
            PlantedModel {
                id: "C9_position_offset",
                field: "position_offset",
                replaced: ["position_offset = \"0.008472 rad\"", "position_offset = \"-0.001528 rad\""],
                value: Some(0.01),
            },
            PlantedModel {
                id: "C9_position_offset",
                field: "position_offset",
                replaced: ["position_offset = \"0.008472 rad\"", "position_offset = \"-0.011528 rad\""],
                value: Some(0.02),
            },
        ],
        ..SO101
    },
    MeasuredSet {
        name: "so101_joint5",
        rig: include_str!("../../rigs/so101_joint5.toml"),
        models: &[
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.09335 s\"", "lag = \"0.07335 s\""],
                value: Some(0.02),
            },
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.09335 s\"", "lag = \"0.05335 s\""],
                value: Some(0.04),
            },
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.09335 s\"", "lag = \"0.01335 s\""],
                value: Some(0.08),
            },
        ],
        ..SO101
    },
    MeasuredSet {
        name: "so101_joint6",
        rig: include_str!("../../rigs/so101_joint6.toml"),
        models: &[
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.07639 s\"", "lag = \"0.05639 s\""],
                value: Some(0.02),
            },
            PlantedModel {
                id: "C2_lag",
                field: "lag",
                replaced: ["lag = \"0.07639 s\"", "lag = \"0.03639 s\""],
                value: Some(0.04),
            },
        ],
        ..SO101
    },
    MeasuredSet {
        name: "ur_servo",
        droppable: false,
        folder: "ur-servo",
        training: &["delay_log.csv"],
        rig: include_str!("../../../../campaigns/rigs/ur_servo.toml"),
        forms: SERVO_EVENTS,
        multiples: &[2.0, 5.0, 20.0],
        ..EMPTY
    },
    MeasuredSet {
        name: "cube",
        droppable: false,
        folder: "cube-tosses",
        training: &["tosses.csv"],
        hold_out_experiments: Some("4:1"),
        rig: include_str!("../../../../campaigns/rigs/cube_toss.toml"),
        models: &[
            PlantedModel {
                id: "K4_friction",
                field: "friction",
                replaced: ["friction = 0.18", "friction = 0.4"],
                value: None,
            },
            PlantedModel {
                id: "K4_friction",
                field: "friction",
                replaced: ["friction = 0.18", "friction = 0.06"],
                value: None,
            },
        ],
        ..EMPTY
    },
    MeasuredSet {
        name: "kr300",
        rig: include_str!("../../rigs/kr300.toml"),
        beside: &[("kr300_identified.toml", include_str!("../../../../campaigns/models/kr300_identified.toml"))],
        joints: &[PlantedJoint { end: ".1", block: "R3 torque to motion, axis 1" }],
        forms: ROBOT,
        multiples: &[2.0],
        ..KUKA_ROBOT
    },
];

/// Forms of a command that is one event: a delay, and the other clock.
const SERVO_EVENTS: &[PlantedForm] =
    &[DELAY, PlantedForm { id: "C5_clock_skew", field: "clock_skew", on_nominal: false, change: PlantedChange::Skew }];

/// Forms of an axis of a robot.
const ROBOT: &[PlantedForm] = &[COULOMB, GAIN, CABLE, DIRECTION];

impl MeasuredSet {
    /// Returns whether its recordings are below a folder of measured data.
    pub fn is_in(&self, data: &Path) -> bool {
        self.training.iter().chain(self.holdout).all(|name| data.join(self.folder).join(name).is_file())
    }
}
