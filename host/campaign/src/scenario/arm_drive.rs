//! Drives of the arm in space: motors, gears, friction, stops and brakes of its joints.

use super::sliding::units;
use crate::arm::{Arm, JointRating};
use crate::check::{Checker, span_of};
use crate::written::At;
use crate::written::campaign::OneOrMore;
use crate::written::scenario::ArmDriveTable;
use softdock_kernels::manipulator::{ArmDrive, Drive, Friction, Stops};
use softdock_kernels::model::Brakes;
use softdock_kernels::range::{DAMPING, FORCE, INERTIA, RATE, Range, STIFFNESS};

/// Travel of a joint in which its dry friction comes 1/e closer to its whole size, where none is written \[rad\].
const PRESLIDING_TRAVEL: f64 = 1e-4;

/// Speed at which the static part of the friction has fallen to 1/e, where none is written \[rad/s\].
const STATIC_SPEED: f64 = 0.01;

/// Values of one key, one for each joint.
struct PerJoint<'a> {
    c: &'a mut Checker,
    /// Which joints slide.
    slides: &'a [bool],
}

impl PerJoint<'_> {
    /// One value for all joints, or a list with one for each; none if the key is not written.
    fn read(&mut self, written: &Option<At<OneOrMore>>, unit: &'static str, range: Range) -> Option<Vec<f64>> {
        let At { value, span } = written.as_ref()?;
        let units = units(self.slides, unit);
        match value {
            OneOrMore::One(scalar) => {
                // One value has one unit: where joints of both kinds are, all but a pure number is refused for one kind.
                let mut kinds = units.clone();
                kinds.dedup();
                kinds.truncate(2);
                let values: Vec<f64> = kinds.iter().map(|unit| self.c.scalar(scalar, span, unit, range)).collect();
                Some(vec![values.first().copied().unwrap_or(1.0); units.len()])
            }
            OneOrMore::More(items) => {
                let items = At { value: items.clone(), span: span.clone() };
                Some(self.c.list_of(&items, &units, range))
            }
        }
    }

    fn read_or(&mut self, written: &Option<At<OneOrMore>>, default: f64, unit: &'static str, range: Range) -> Vec<f64> {
        self.read(written, unit, range).unwrap_or_else(|| vec![default; self.slides.len()])
    }

    /// The same with what the URDF states of each joint as default.
    fn read_or_rated(
        &mut self,
        written: &Option<At<OneOrMore>>,
        (arm, rated): (&Arm, fn(&JointRating) -> Option<f64>),
        default: f64,
        unit: &'static str,
        range: Range,
    ) -> Vec<f64> {
        let own = || arm.ratings.iter().map(|rating| rated(rating).unwrap_or(default)).collect();
        self.read(written, unit, range).unwrap_or_else(own)
    }
}

/// The drives of the joints and when their brakes close; `angles` are those of the start posture.
pub(super) fn read(c: &mut Checker, table: &ArmDriveTable, arm: &Arm, angles: &[f64]) -> (Vec<ArmDrive>, Brakes) {
    let joints = arm.joints.len();
    let (stiff, damp) = (Range::above(0.0, STIFFNESS), Range::within(0.0, DAMPING));
    let (torque, positive) = (Range::within(0.0, FORCE), Range::above(0.0, FORCE));
    refuse_alone(c, table);
    let mut per = PerJoint { c, slides: &arm.slides };
    let inertia = Some(table.rotor_inertia.clone());
    let rotor = per.read_or(&inertia, 1.0, "kg m^2", Range::above(0.0, INERTIA));
    let ratio = per.read_or(&table.gear_ratio, 1.0, "1", Range::within(0.1, 1e5));
    let stiffness = per.read_or(&table.stiffness, f64::INFINITY, "N m/rad", stiff);
    let damping = per.read_or(&table.damping, 0.0, "N m s/rad", damp);
    let backlash = per.read_or(&table.backlash, 0.0, "rad", Range::within(0.0, 0.1));
    let coulomb = per.read_or_rated(&table.coulomb_friction, (arm, |own| own.friction), 0.0, "N m", torque);
    let viscous = per.read_or_rated(&table.viscous_friction, (arm, |own| own.damping), 0.0, "N m s/rad", damp);
    let stribeck = per.read_or(&table.static_friction, 0.0, "N m", torque);
    let static_speed = per.read_or(&table.static_speed, STATIC_SPEED, "rad/s", Range::above(0.0, RATE));
    let travel = per.read_or(&table.presliding_travel, PRESLIDING_TRAVEL, "rad", Range::within(1e-7, 0.1));
    let most = f64::INFINITY;
    let torque_limit = per.read_or_rated(&table.torque_limit, (arm, |own| own.effort), most, "N m", positive);
    let rate = Range::above(0.0, RATE);
    let speed_limit = per.read_or_rated(&table.speed_limit, (arm, |own| own.velocity), most, "rad/s", rate);
    let stop_stiffness = per.read(&table.stop_stiffness, "N m/rad", stiff);
    let stop_damping = per.read_or(&table.stop_damping, 0.0, "N m s/rad", damp);
    let brake = per.read_or(&table.brake_torque, 0.0, "N m", positive);
    let brakes = brakes(c, table);
    let drives = (0..joints).map(|i| {
        let (lower, upper) = arm.limits[i];
        let stop = |stiffness: &Vec<f64>| Stops {
            lower: lower - angles.get(i).unwrap_or(&0.0),
            upper: upper - angles.get(i).unwrap_or(&0.0),
            stiffness: stiffness[i],
            damping: stop_damping[i],
        };
        ArmDrive {
            drive: Drive {
                gear_ratio: ratio[i],
                rotor_inertia: rotor[i],
                gear_stiffness: stiffness[i],
                gear_damping: damping[i],
                backlash: backlash[i],
                torque_limit: torque_limit[i],
                ..Drive::ideal()
            },
            friction: Friction {
                coulomb: coulomb[i],
                viscous: viscous[i],
                stribeck: stribeck[i],
                stribeck_speed: static_speed[i],
                ..Friction::none()
            },
            presliding_travel: travel[i],
            speed_limit: speed_limit[i],
            stops: stop_stiffness.as_ref().filter(|_| lower.is_finite() && upper.is_finite()).map(stop),
            brake: brake[i],
        }
    });
    (drives.collect(), brakes)
}

/// Refuses keys that do nothing without another one.
fn refuse_alone(c: &mut Checker, table: &ArmDriveTable) {
    let pairs = [
        ("stiffness", table.stiffness.is_some(), "damping", span_of(&table.damping)),
        ("stop_stiffness", table.stop_stiffness.is_some(), "stop_damping", span_of(&table.stop_damping)),
        ("static_friction", table.static_friction.is_some(), "static_speed", span_of(&table.static_speed)),
    ];
    for (needed, has, name, span) in pairs {
        if let Some(span) = span.filter(|_| !has) {
            c.refuse(&span, format!("`{name}` does nothing without `{needed}`"), format!("add {needed}, or remove it"));
        }
    }
}

fn brakes(c: &mut Checker, table: &ArmDriveTable) -> Brakes {
    match (&table.brakes, &table.brake_torque) {
        (Some(written), Some(_)) => {
            c.choice(written, &[("closed", Brakes::Closed), ("close_at_touch", Brakes::CloseAtTouch)])
        }
        (None, None) => Brakes::Open,
        (Some(At { span, .. }), None) => {
            c.refuse(span, "the brakes have no torque", "add brake_torque, or remove `brakes`");
            Brakes::Open
        }
        (None, Some(At { span, .. })) => {
            let remedy = "add brakes = \"closed\" or \"close_at_touch\", or remove `brake_torque`";
            c.refuse(span, "it is not said when the brakes are closed", remedy);
            Brakes::Open
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_notes::arm_lines;
    use crate::problem::Problems;
    use crate::scenario::Scenario;
    use crate::source::Source;
    use std::path::Path;

    /// The berthing scenario with a table `[arm.drive]`.
    fn berth(table: &str) -> Result<Scenario, Problems> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios/berth.toml");
        let text = std::fs::read_to_string(&path).expect("the shipped scenario");
        Scenario::from_source(Source::new(path, text.replace("[part_a]", &format!("{table}\n[part_a]"))))
    }

    #[test]
    fn values_are_for_all_joints_or_one_for_each_and_the_urdf_states_the_rest() {
        let table = "[arm.drive]\nrotor_inertia = \"2e-4 kg m^2\"\ngear_ratio = [100, 100, 100, 100, 80, 80, 80]\n\
                     stiffness = \"2e4 N m/rad\"\ndamping = \"10 N m s/rad\"\nstop_stiffness = \"1e4 N m/rad\"\n\
                     coulomb_friction = \"3 N m\"\nbrake_torque = \"90 N m\"\nbrakes = \"close_at_touch\"";
        let scenario = berth(table).unwrap_or_else(|problems| panic!("{problems}"));
        let drives = &scenario.model.drives;
        assert_eq!((drives.len(), scenario.model.brakes), (7, Brakes::CloseAtTouch));
        assert!((drives[0].drive.reflected_inertia() - 2.0).abs() < 1e-12);
        assert!((drives[6].drive.reflected_inertia() - 1.28).abs() < 1e-12);
        assert_eq!((drives[0].drive.torque_limit, drives[0].speed_limit), (150.0, 0.2), "of the URDF");
        let stops = drives[1].stops.expect("the URDF has limits");
        assert!((stops.upper - (180.0001_f64 - 30.0).to_radians()).abs() < 1e-5, "from the start posture: {stops:?}");
        let lines = arm_lines(&scenario);
        assert!(
            lines[0].contains("rotor 2 kg m^2") && lines[0].contains("brake 90 N m from the first touch"),
            "{lines:?}"
        );
        let plain = arm_lines(&berth("").expect("the shipped scenario"));
        assert!(plain.len() == 1 && plain[0].contains("of 7 joints"), "{plain:?}");
    }

    #[test]
    fn drives_that_contradict_themselves_or_the_step_are_refused() {
        let rotor = "[arm.drive]\nrotor_inertia = \"2e-4 kg m^2\"\ngear_ratio = 100\n";
        let cases = [
            ("[arm.drive]\ngear_ratio = 100".to_owned(), "must be there", "rotor_inertia"),
            (rotor.replace("= 100", "= [100, 100]"), "2 values where 7 belong", "write 7 values"),
            (rotor.replace("2e-4", "0"), "out of range", "above 0"),
            (format!("{rotor}damping = \"1 N m s/rad\""), "does nothing without `stiffness`", "add stiffness"),
            (format!("{rotor}stop_damping = \"1 N m s/rad\""), "does nothing without `stop_stiffness`", "remove it"),
            (format!("{rotor}brake_torque = \"9 N m\""), "not said when the brakes are closed", "close_at_touch"),
            (format!("{rotor}brakes = \"closed\""), "the brakes have no torque", "brake_torque"),
            (format!("{rotor}stiffness = \"2e4 N\""), "this is a force", "N m/rad"),
            (format!("{rotor}stop_stiffness = \"1e9 N m/rad\""), "stop of joint", "timing.substep"),
            (
                format!("{rotor}coulomb_friction = \"90 N m\"\npresliding_travel = \"0.001 mrad\""),
                "friction of joint",
                "soften",
            ),
            (rotor.replace("= 100", "= 1"), "controller of joint", "timing.tick"),
        ];
        for (table, what, remedy) in cases {
            let problems = berth(&table).expect_err(&table);
            let found = problems.iter().any(|own| own.to_string().contains(what) && own.remedy.contains(remedy));
            assert!(found, "{table}: {problems}");
        }
    }
}
