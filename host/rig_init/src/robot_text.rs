//! Robot model file from a URDF and a log, and the rig file that names it.

use crate::clock::Clock;
use crate::drive_fit::{DriveFit, Load, StartValue};
use crate::drive_text::{write_clock, write_torque};
use crate::figures::{extent, short};
use crate::joints::JointColumns;
use crate::names::Meaning;
use crate::recorded_table::RecordedTable;
use crate::toml_text::{TomlText, quoted};
use softdock_campaign::urdf::{UrdfJoint, UrdfRobot};
use softdock_kernels::manipulator::{Manipulator, rigid_torques};
use softdock_kernels::with_joints;
use std::f64::consts::TAU;

/// Stiffness of a gear that counts as rigid \[N m/rad\], and the travel of presliding \[rad\].
const RIGID: f64 = 1e9;
const PRESLIDING: f64 = 1e-3;

/// A robot and the columns of its joints.
pub(crate) struct RecordedRobot<'a> {
    pub(crate) urdf: &'a UrdfRobot,
    pub(crate) joints: Vec<&'a JointColumns>,
    pub(crate) fits: Vec<Option<DriveFit>>,
    /// Scale of each recorded torque that fits the links best, where the log shows it.
    scales: Vec<Option<f64>>,
}

impl<'a> RecordedRobot<'a> {
    /// Assigns joints to columns, by name where the columns name the joints, otherwise by number; fits the drives.
    ///
    /// # Errors
    /// If the log has other joints than the robot.
    pub(crate) fn of(urdf: &'a UrdfRobot, found: &'a [JointColumns], clock: &Clock) -> Result<Self, String> {
        let by_name = |joint: &UrdfJoint| found.iter().find(|columns| columns.position.contains(&joint.name));
        let named: Option<Vec<&JointColumns>> = urdf.joints.iter().map(by_name).collect();
        let joints = match named {
            Some(named) => named,
            None if found.len() == urdf.joints.len() => found.iter().collect(),
            None => {
                return Err(format!(
                    "the log has positions of {} joints, and the URDF has {} joints that move",
                    found.len(),
                    urdf.joints.len()
                ));
            }
        };
        let torques = with_joints!(joints.len(), model_torques(&urdf.rigid(), &joints));
        let known = |joint: &JointColumns| joint.torque.as_ref().is_some_and(|torque| torque.scale.is_some());
        let pairs = || joints.iter().zip(&torques);
        let fits = pairs().map(|(joint, model)| fit(joint, model, clock, !known(joint))).collect();
        let scales = pairs().map(|(joint, model)| Some(fit(joint, model, clock, true)?.scale).filter(|_| known(joint)));
        let scales = scales.collect();
        Ok(Self { urdf, joints, fits, scales })
    }

    /// Writes the robot's model file.
    pub(crate) fn model(&self, out: &mut TomlText, id: &str, file: &str, clock: &Clock) {
        out.push("schema = \"robot/1\"");
        out.push(&format!("id = {}", quoted(id)));
        out.push(&format!("title = {}", quoted(&format!("{}, from its URDF", self.urdf.name))));
        let [x, y, z] = self.urdf.base;
        out.comment(&format!(
            "Modified Denavit-Hartenberg table of the URDF's axes. Its base stands at ({}, {}, {}) m of the URDF's root link, \
             turned by {} rad about the vertical; gravity acts along -z.",
            short(x),
            short(y),
            short(z),
            short(self.urdf.base_turn)
        ));
        out.table("workspace");
        let basis = "upper bound: the sum of the table's lengths beyond axis 1; used by facilities, not by diagnoses";
        out.quantity("reach", self.urdf.reach_bound(), "m", basis);
        out.open("payload", "kg", "rated load at the flange, 0 or more; used by facilities, not by diagnoses");
        out.open("repeatability", "mm", "plus or minus, 0 to 1000 mm; used by facilities, not by diagnoses");
        out.push("source = \"to be stated\"");
        for (i, joint) in self.urdf.joints.iter().enumerate() {
            joint_tables(out, joint, self.joints[i], self.fits[i].as_ref(), file);
        }
        self.log(out, clock);
    }

    fn log(&self, out: &mut TomlText, clock: &Clock) {
        out.table("log");
        write_clock(out, clock);
        for (i, joint) in self.joints.iter().enumerate() {
            let name = |signal: &str| format!("r1.{signal}.{}", i + 1);
            out.column(&name("q"), &joint.position, joint.unit.value, "", &joint.unit.basis);
            if let Some((column, unit)) = &joint.reference {
                out.column(&name("q_ref"), column, unit, "", "");
            }
            if let Some((column, unit)) = &joint.link {
                out.column(&name("q_link"), column, unit, "", "");
            }
            let Some(torque) = &joint.torque else { continue };
            match (&self.fits[i], torque.scale) {
                (Some(fit), None) => {
                    let mut torque = torque.clone();
                    torque.basis = format!(
                        "{}; {} N m per {} explains the weight and inertia of the URDF's links best: start value",
                        torque.basis,
                        short(fit.scale),
                        torque.recorded
                    );
                    write_torque(out, &name("tau"), &torque, "N m", Some(fit.scale));
                }
                (_, scale) => write_torque(out, &name("tau"), torque, "N m", scale),
            }
        }
    }

    /// Writes `[robot]` and `[tolerance]` of the rig file.
    pub(crate) fn rig(&self, out: &mut TomlText, model: &str, clock: &Clock) {
        out.table("robot");
        out.key("model", &quoted(model), "links, drives, friction, and the columns of the recordings");
        out.key("rigid_gears", "true", "a URDF states no gears; false once their stiffness is filled in");
        out.key("plain_friction", "true", "Coulomb and viscous friction alone");
        out.table("tolerance");
        out.remark(
            "One standard deviation of what may differ unnoticed; a parameter that is not named is known exactly.",
        );
        out.open("link_inertia", "%", "how well the URDF states the links' inertia, as a share of it; 0 to 100 %");
        let worst = |of: fn(&DriveFit) -> Option<StartValue>| {
            let values: Option<Vec<StartValue>> = self.fits.iter().map(|fit| fit.as_ref().and_then(of)).collect();
            values.map(|values| values.iter().map(|value| value.scatter).fold(0.0, f64::max))
        };
        let rows = [
            ("motor_inertia", worst(|fit| Some(fit.inertia))),
            ("coulomb", worst(|fit| fit.coulomb)),
            ("viscous", worst(|fit| fit.viscous)),
        ];
        for (key, scatter) in rows {
            match scatter {
                Some(scatter) => {
                    let basis = "largest standard error of an axis over parts of the log";
                    out.key(key, &format!("\"{} %\"", (100.0 * scatter).ceil()), basis);
                }
                None => out.open(key, "%", "how well it is known, as a share of it; 0 to 100 %"),
            }
        }
        out.key("presliding_travel", "\"50 %\"", "the travel itself is assumed");
        let half = short(500.0 * clock.step);
        out.key("clock_offset", &format!("\"{half} ms\""), "half a step of the log");
    }

    /// Notes on joints whose names in the log say otherwise.
    pub(crate) fn notes(&self, table: &RecordedTable) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.urdf.fixed.is_empty() {
            notes.push(format!("fixed at their zero: {}", self.urdf.fixed.join(", ")));
        }
        if table.of(Meaning::Torque).chain(table.of(Meaning::Current)).next().is_none() {
            notes.push("the log has no torques or currents of the joints: drives cannot be diagnosed".to_owned());
        }
        notes.extend(self.scales.iter().enumerate().filter_map(|(i, scale)| {
            let scale = (*scale)?;
            (!(0.6..1.6).contains(&scale)).then(|| {
                let factor = short(scale);
                format!(
                    "axis {}: {factor} times the recorded torque fits the URDF's links best: check its unit and side",
                    i + 1
                )
            })
        }));
        for (i, joint) in self.joints.iter().enumerate() {
            let (low, high) = extent(&joint.motion.value);
            if let Some((lower, upper)) = self.urdf.joints[i].range
                && (low < lower - 0.01 || high > upper + 0.01)
            {
                notes.push(format!(
                    "axis {} moves from {} to {} rad, outside the URDF's limits {} to {}: check unit, sign and zero",
                    i + 1,
                    short(low),
                    short(high),
                    short(lower),
                    short(upper)
                ));
            }
        }
        notes
    }
}

/// Torques of the links along a log, joint by joint; NaN where a motion is missing.
fn model_torques<const N: usize>(robot: &Manipulator, joints: &[&JointColumns]) -> Vec<Vec<f64>> {
    let rows = joints[0].motion.value.len();
    let mut torques = vec![Vec::with_capacity(rows); N];
    for row in 0..rows {
        let at = |of: fn(&JointColumns) -> &Vec<f64>| -> [f64; N] { std::array::from_fn(|i| of(joints[i])[row]) };
        let (angle, rate) = (at(|joint| &joint.motion.value), at(|joint| &joint.motion.rate));
        let torque = rigid_torques(robot, angle, rate, at(|joint| &joint.motion.acceleration));
        torques.iter_mut().zip(torque).for_each(|(column, value)| column.push(value));
    }
    torques
}

/// `free`: the scale of the torque is fitted too.
fn fit(joint: &JointColumns, model: &[f64], clock: &Clock, free: bool) -> Option<DriveFit> {
    let column = joint.torque.as_ref()?;
    let scale = column.scale.unwrap_or(1.0);
    let torque: Vec<f64> = column.values.iter().map(|value| value * scale).collect();
    DriveFit::of(&Load {
        time: &clock.time,
        step: clock.step,
        motion: &joint.motion,
        torque: &torque,
        prismatic: false,
        model: Some((model, free)),
    })
}

fn joint_tables(out: &mut TomlText, joint: &UrdfJoint, columns: &JointColumns, fit: Option<&DriveFit>, file: &str) {
    let source = format!("source = {}", quoted(&format!("{file}, joint {}", joint.name)));
    let row = &joint.row;
    out.push(&format!("\n[[joint]]\nname = {}", quoted(&joint.name)));
    out.push("[joint.kinematics]");
    out.push(&format!("a = \"{} m\"\nalpha = \"{} rad\"\nd = \"{} m\"", row.a, row.alpha, row.d));
    out.push(&format!("offset = \"{} rad\"\nsign = {}\n{source}", row.offset, row.sign));
    let (link, i) = (&joint.link, &joint.link.inertia);
    out.push("[joint.link]");
    out.push(&format!("mass = \"{} kg\"", link.mass));
    out.push(&format!("com = [\"{} m\", \"{} m\", \"{} m\"]", link.com.x, link.com.y, link.com.z));
    let moments = [("ixx", i.xx), ("iyy", i.yy), ("izz", i.zz), ("ixy", i.xy), ("ixz", i.xz), ("iyz", i.yz)];
    let moments = moments.map(|(name, value)| format!("{name} = \"{value} kg m^2\"")).join(", ");
    out.push(&format!("inertia = {{ {moments} }}\n{source}"));
    drive(out, joint, fit);
    friction(out, joint, fit);
    limits(out, joint, columns, &source);
}

fn drive(out: &mut TomlText, joint: &UrdfJoint, fit: Option<&DriveFit>) {
    out.push("[joint.drive]");
    match fit {
        Some(fit) => {
            let basis = format!(
                "start value: inertia of rotor and gear input at the joint's side, with the gear ratio 1, by least squares over \
                 the log ({} % of the torque unexplained, standard error {} %); or write gear ratio and rotor of \
                 the data sheet",
                short(100.0 * fit.unexplained),
                short(100.0 * fit.inertia.scatter)
            );
            out.quantity("rotor_inertia", fit.inertia.value, "kg m^2", &basis);
            out.push("gear_ratio = 1.0");
            out.quantity("torque_offset", fit.offset, "N m", "from the same fit");
        }
        None => {
            out.open("gear_ratio", "", "motor angle per joint angle; above 0, 1 if rotor_inertia counts at the joint");
            out.open("rotor_inertia", "kg m^2", "of rotor and gear input at the motor's side; 0 or more");
        }
    }
    let basis = "rigid: not used while the rig file has rigid_gears = true";
    out.key("gear_stiffness", &format!("\"{RIGID:e} N m/rad\""), basis);
    out.push("gear_damping = \"0 N m s/rad\"");
    match joint.effort {
        Some(effort) => out.quantity("torque_limit", effort, "N m", "effort of the URDF"),
        None => out.open("torque_limit", "N m", "greatest torque of the motor at the joint's side; above 0"),
    }
    out.key("static_torque", "\"0 N m\"", "no rated torque is stated");
    out.push("source = \"softdock rig init\"");
}

fn friction(out: &mut TomlText, joint: &UrdfJoint, fit: Option<&DriveFit>) {
    out.push("[joint.friction]");
    let fitted = |of: fn(&DriveFit) -> Option<StartValue>| fit.and_then(of);
    let mut known = None;
    let rows = [
        ("coulomb", "N m", joint.friction, fitted(|fit| fit.coulomb)),
        ("viscous", "N m s/rad", joint.damping, fitted(|fit| fit.viscous)),
    ];
    for (key, unit, stated, fitted) in rows {
        let value = match (fitted, stated) {
            (Some(start), stated) => {
                let stated = stated.map_or(String::new(), |value| format!("; the URDF states {}", short(value)));
                let basis =
                    format!("start value by least squares, standard error {} %{stated}", short(100.0 * start.scatter));
                out.quantity(key, start.value, unit, &basis);
                Some(start.value)
            }
            (None, Some(value)) => {
                out.quantity(key, value, unit, "<dynamics> of the URDF");
                Some(value)
            }
            (None, None) => {
                out.open(key, unit, &format!("{key} friction at the joint's side; 0 or more"));
                None
            }
        };
        known = known.or(value.filter(|_| key == "coulomb"));
    }
    let stiffness = known.filter(|coulomb| *coulomb > 0.0).map_or(RIGID, |coulomb| coulomb / PRESLIDING);
    let basis = "assumed: friction is nearly complete after a milliradian";
    out.quantity("presliding_stiffness", stiffness, "N m/rad", basis);
    out.push("source = \"softdock rig init\"");
}

fn limits(out: &mut TomlText, joint: &UrdfJoint, columns: &JointColumns, source: &str) {
    out.push("[joint.limits]");
    let (lower, upper) = joint.range.unwrap_or_else(|| {
        out.comment("a joint without a stop: one turn each way");
        (-TAU, TAU)
    });
    out.push(&format!("lower = \"{lower} rad\"\nupper = \"{upper} rad\""));
    let greatest = |values: &[f64]| values.iter().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
    match joint.speed {
        Some(speed) => out.push(&format!("speed = \"{speed} rad/s\"")),
        None => out.open("speed", "rad/s", "greatest speed; above 0"),
    }
    let acceleration = greatest(&columns.motion.acceleration);
    if acceleration > 0.0 {
        let basis = "the greatest of the log; raise it to the controller's limit";
        out.quantity("acceleration", acceleration, "rad/s^2", basis);
    } else {
        out.open("acceleration", "rad/s^2", "greatest acceleration; above 0");
    }
    out.push(source);
}
