//! The nominal robot: three axes, their links and drives, the tolerances, and the texts of the model files.

use crate::space::Vector;
use std::fmt::Write;

/// Number of axes: base, shoulder, elbow.
pub(crate) const AXES: usize = 3;

/// One axis with the link behind it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) name: &'static str,
    /// Row of the modified Denavit-Hartenberg table: a \[m\], alpha \[rad\], d \[m\].
    pub(crate) row: [f64; 3],
    /// Mass \[kg\], centre of mass \[m\] and moments of inertia about it \[kg m^2\], link axes.
    pub(crate) mass: f64,
    pub(crate) com: Vector,
    pub(crate) inertia: Vector,
    /// Rotor as the joint feels it \[kg m^2\], stiffness \[N m/rad\] and damping \[N m s/rad\] of the gear.
    pub(crate) rotor: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    /// Coulomb \[N m\] and viscous friction \[N m s/rad\].
    pub(crate) coulomb: f64,
    pub(crate) viscous: f64,
    /// Inertia for which the controller's gains are laid out \[kg m^2\].
    pub(crate) moved: f64,
}

/// Bristle deflection at which friction slides, all axes \[rad\].
pub(crate) const PRESLIDING_TRAVEL: f64 = 0.0002;
/// Motor turns per turn of a joint.
const GEAR_RATIO: f64 = 100.0;
/// A quarter turn: axis 2 lies across axis 1 \[rad\].
const ACROSS: f64 = -std::f64::consts::FRAC_PI_2;

/// The robot; its second and third axis are horizontal, at 0 the arm is stretched forwards.
pub(crate) const ROBOT: [Axis; AXES] = [
    Axis {
        name: "base",
        row: [0.0, 0.0, 0.6],
        mass: 60.0,
        com: [0.05, 0.0, -0.1],
        inertia: [2.0, 2.0, 1.5],
        rotor: 12.0,
        stiffness: 2.0e6,
        damping: 300.0,
        coulomb: 30.0,
        viscous: 40.0,
        moved: 40.0,
    },
    Axis {
        name: "shoulder",
        row: [0.2, ACROSS, 0.0],
        mass: 30.0,
        com: [0.35, 0.0, 0.02],
        inertia: [0.2, 1.5, 1.5],
        rotor: 12.0,
        stiffness: 2.0e6,
        damping: 300.0,
        coulomb: 25.0,
        viscous: 35.0,
        moved: 36.0,
    },
    Axis {
        name: "elbow",
        row: [0.8, 0.0, 0.0],
        mass: 15.0,
        com: [0.3, 0.0, 0.01],
        inertia: [0.1, 0.6, 0.6],
        rotor: 3.0,
        stiffness: 1.0e6,
        damping: 100.0,
        coulomb: 10.0,
        viscous: 12.0,
        moved: 5.0,
    },
];

/// Tolerances: standard deviations of the nuisance parameters: shares, but s for the clock.
pub(crate) mod tolerance {
    pub(crate) const COULOMB: f64 = 0.03;
    pub(crate) const VISCOUS: f64 = 0.03;
    pub(crate) const TORQUE_CONSTANT: f64 = 0.005;
    pub(crate) const PRESLIDING_TRAVEL: f64 = 0.2;
    pub(crate) const CLOCK_OFFSET: f64 = 0.0002;
}

/// Name of the robot's own model file.
pub(crate) const FILE: &str = "robot.toml";

/// The rig's model file.
pub(crate) const RIG: &str = r#"schema = "rig/1"
kind = "robot"
id = "bench-robot"

[robot]
model = "robot.toml"
period = "1 ms"

# Tolerances: standard deviations of the nuisance parameters, axis by axis.
[tolerance]
coulomb = "3 %"
viscous = "3 %"
torque_constant = "0.5 %"
presliding_travel = "20 %"
clock_offset = "0.2 ms"
"#;

/// The robot's model file.
pub(crate) fn robot() -> String {
    let mut text = String::from(
        "schema = \"robot/1\"\nid = \"bench-robot\"\ntitle = \"Three axes on a bench\"\n\n[workspace]\n\
         reach = \"1.7 m\"\npayload = \"10 kg\"\nrepeatability = \"0.1 mm\"\nsource = \"the bench\"\n",
    );
    for Axis { name, row: [a, alpha, d], mass, com, inertia, rotor, stiffness, damping, coulomb, viscous, .. } in ROBOT
    {
        let rotor = rotor / (GEAR_RATIO * GEAR_RATIO);
        let presliding = coulomb / PRESLIDING_TRAVEL;
        let _ = write!(
            text,
            "\n[[joint]]\nname = \"{name}\"\n[joint.kinematics]\na = \"{a} m\"\nalpha = \"{alpha} rad\"\nd = \"{d} m\"\n\
             offset = \"0 rad\"\nsign = 1\nsource = \"the bench\"\n[joint.link]\nmass = \"{mass} kg\"\n\
             com = [\"{} m\", \"{} m\", \"{} m\"]\n\
             inertia = {{ ixx = \"{} kg m^2\", iyy = \"{} kg m^2\", izz = \"{} kg m^2\", ixy = \"0 kg m^2\", \
             ixz = \"0 kg m^2\", iyz = \"0 kg m^2\" }}\nsource = \"the bench\"\n[joint.drive]\n\
             gear_ratio = {GEAR_RATIO}\nrotor_inertia = \"{rotor} kg m^2\"\ngear_stiffness = \"{stiffness} N m/rad\"\n\
             gear_damping = \"{damping} N m s/rad\"\ntorque_limit = \"2000 N m\"\nstatic_torque = \"0 N m\"\n\
             source = \"the bench\"\n[joint.friction]\ncoulomb = \"{coulomb} N m\"\nviscous = \"{viscous} N m s/rad\"\n\
             presliding_stiffness = \"{presliding} N m/rad\"\nsource = \"the bench\"\n[joint.limits]\n\
             lower = \"-2 rad\"\nupper = \"2 rad\"\nspeed = \"3 rad/s\"\nacceleration = \"20 rad/s^2\"\n\
             source = \"the bench\"\n",
            com[0], com[1], com[2], inertia[0], inertia[1], inertia[2],
        );
    }
    text += "\n# 250 Hz, every fourth tick of the controller; t goes on from recording to recording.\n[log]\n\
             \"t\" = { column = \"t_s\", unit = \"s\" }\n";
    for axis in 1..=AXES {
        let _ = writeln!(text, "\"r1.q.{axis}\" = {{ column = \"q_rad_{axis}\", unit = \"rad\" }}");
        let _ = writeln!(text, "\"r1.tau.{axis}\" = {{ column = \"tau_nm_{axis}\", unit = \"N m\" }}");
    }
    text
}
