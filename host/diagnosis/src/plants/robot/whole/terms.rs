//! Terms of the robot's torques: calibration of each axis, and causes that load several axes at once.

use crate::plants::robot::coupling::{Instant, coupled};
use crate::plants::robot::links::helped;
use softdock_campaign::rig::RobotRig;
use softdock_kernels::manipulator::{Manipulator, RobotErrors, rigid_torques};
use softdock_kernels::vector::vec3;
use std::ops::Range;

/// Calibration terms of an axis: Coulomb and viscous friction, offset, inertia, torque constant.
pub(super) const CALIBRATION: usize = 5;
/// Standard deviation of a torque constant, as a share; and of a calibrated inertia.
const CONSTANT: f64 = 0.05;
/// Share of friction and torque that the calibration may move.
const FRICTION: f64 = 0.3;
const SMALLEST: f64 = 0.02;
const OFFSET: f64 = 0.05;
/// The same of the alternative: separate errors of every axis.
const LOCAL_CONSTANT: f64 = 0.3;
const LOCAL_INERTIA: f64 = 0.3;
const LOCAL_GRAVITY: f64 = 0.1;
/// Share of the rated load that is a plausible error, its distance from the flange \[m\], and a plausible tilt \[rad\].
const LOAD: f64 = 0.3;
const PLACE: f64 = 0.15;
const TILT: f64 = 0.02;
/// Greatest tilt of a base \[rad\]; greatest load as a share of the rated one; farthest centre of a load \[m\].
const STEEPEST: f64 = 0.2;
const HEAVIEST: f64 = 2.0;
const FARTHEST: f64 = 1.0;
/// Axes of the wrist that may be coupled to the one before, from 0, if the robot has so many.
const WRIST: [usize; 2] = [4, 5];
/// Speed over which sliding friction changes sign \[rad/s\], at least, and as a share of the greatest rate.
const REVERSAL: f64 = 0.002;
const REVERSAL_SHARE: f64 = 0.005;

/// Kind of a cause.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Mass at the flange with its first moments.
    Load,
    /// Tilt of the base.
    Tilt,
    /// Coupling of an axis, from 0, to the one before, with its ratio.
    Coupling(usize, f64),
    /// Separate errors of every axis: the alternative to a common cause.
    Local,
}

/// Cause with its places among the common terms.
#[derive(Clone, Debug)]
pub(super) struct Cause {
    /// Kind.
    pub(super) kind: Kind,
    /// Its common terms.
    pub(super) terms: Range<usize>,
}

/// The terms of a robot.
pub(super) struct Terms {
    /// The causes that are judged; the local one comes last.
    pub(super) causes: Vec<Cause>,
    /// Place of the load about which its terms are linear, in flange axes \[m\].
    pub(super) place: [f64; 3],
    /// Couplings whose terms there are: axis, from 0, and ratio.
    couplings: Vec<(usize, f64)>,
    /// Prior standard deviation of each common term, SI.
    pub(super) deviations: Vec<f64>,
    /// Prior standard deviation of each calibration term, by axis.
    pub(super) calibration: Vec<[f64; CALIBRATION]>,
}

/// Extent of the motion of an axis over all recordings.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// Root mean square of the torque \[N m\].
    pub(super) torque: f64,
    /// Root mean square and greatest rate \[rad/s\].
    pub(super) rate: f64,
    pub(super) fastest: f64,
}

impl Terms {
    /// Returns the terms of a robot, with priors from its ratings and drives and from what its axes did.
    pub(super) fn of(rig: &RobotRig, extents: &[Extent], place: [f64; 3], is_judged: &dyn Fn(Kind) -> bool) -> Self {
        let axes = rig.drives.len();
        let mut all =
            Self { causes: Vec::new(), place, couplings: Vec::new(), deviations: Vec::new(), calibration: Vec::new() };
        let load = LOAD * rig.model.workspace.payload;
        all.add(Kind::Load, &[load, load * PLACE, load * PLACE, load * PLACE]);
        all.add(Kind::Tilt, &[TILT; 2]);
        for axis in WRIST.into_iter().filter(|axis| *axis < axes && axes >= 6) {
            let own = &rig.drives[axis].values;
            let size = |value: f64| value.max(SMALLEST * extents[axis].torque);
            let deviations = [own.motor_inertia, size(own.viscous), size(own.coulomb), 1.0];
            for ratio in [1.0, -1.0] {
                all.couplings.push((axis, ratio));
                all.add(Kind::Coupling(axis, ratio), &deviations);
            }
        }
        let mut local = Vec::new();
        for (drive, extent) in rig.drives.iter().zip(extents) {
            let inertia = drive.values.motor_inertia + drive.link_inertia;
            local.extend([
                LOCAL_GRAVITY * extent.torque,
                LOCAL_GRAVITY * extent.torque,
                LOCAL_INERTIA * inertia,
                LOCAL_CONSTANT,
            ]);
            let least = SMALLEST * extent.torque;
            all.calibration.push([
                (FRICTION * drive.values.coulomb).max(least),
                (FRICTION * drive.values.viscous).max(least / extent.rate.max(f64::MIN_POSITIVE)),
                OFFSET * extent.torque,
                CONSTANT * inertia,
                CONSTANT,
            ]);
        }
        all.add(Kind::Local, &local);
        all.causes.retain(|cause| is_judged(cause.kind));
        all
    }

    fn add(&mut self, kind: Kind, deviations: &[f64]) {
        let from = self.deviations.len();
        self.deviations.extend(deviations);
        self.causes.push(Cause { kind, terms: from..self.deviations.len() });
    }
}

/// Robots that differ from the model by a unit of each common term that inverse dynamics gives.
pub(super) struct Variants {
    /// A kilogram at the place of the load; the same moved by a metre to either side along each axis.
    load: Manipulator,
    sides: [[Manipulator; 2]; 3],
    tilts: [Manipulator; 2],
}

impl Variants {
    pub(super) fn of(robot: &Manipulator, place: [f64; 3]) -> Self {
        let along = |axis: usize, size: f64| {
            let [x, y, z] = [0, 1, 2].map(|own| place[own] + if own == axis { size } else { 0.0 });
            robot.with_load(1.0, vec3(x, y, z))
        };
        let tilted = |tilt_x, tilt_y| robot.with_errors(&RobotErrors { tilt_x, tilt_y, ..RobotErrors::null() });
        Self {
            load: along(0, 0.0),
            sides: [0, 1, 2].map(|axis| [along(axis, 1.0), along(axis, -1.0)]),
            tilts: [tilted(TILT, 0.0), tilted(0.0, TILT)],
        }
    }
}

/// Returns the torque that the model lacks, and the calibration and common terms per unit, for every axis:
/// `[axis][lack, calibration.., common..]`.
pub(super) fn rows<const N: usize>(
    rig: &RobotRig,
    variants: &Variants,
    terms: &Terms,
    extents: &[Extent],
    now: &Instant<N>,
) -> [Vec<f64>; N] {
    let Instant { angle, rate, acceleration, torque } = *now;
    let torques = |robot: &Manipulator| rigid_torques(robot, angle, rate, acceleration);
    let model = torques(&rig.model);
    let less = |a: [f64; N], b: [f64; N]| -> [f64; N] { std::array::from_fn(|axis| a[axis] - b[axis]) };
    let mut common: Vec<[f64; N]> = vec![less(torques(&variants.load), model)];
    // The inertia of the load is equal on both sides; half their difference is the first moment.
    common.extend(variants.sides.iter().map(|[plus, minus]| less(torques(plus), torques(minus)).map(|t| 0.5 * t)));
    common.extend(variants.tilts.iter().map(|tilted| less(torques(tilted), model).map(|t| t / TILT)));
    let sign = |axis: usize, rate: f64| (rate / REVERSAL.max(REVERSAL_SHARE * extents[axis].fastest)).tanh();
    for (axis, ratio) in terms.couplings.iter().copied() {
        common.extend(coupled(now, axis, ratio, |rate| sign(axis, rate)));
    }
    std::array::from_fn(|axis| {
        let (own, rate, acceleration) = (&rig.drives[axis].values, rate[axis], acceleration[axis]);
        let weight = model[axis] - helped(&rig.model, axis, angle[axis]);
        let load = weight + own.gravity_cos * angle[axis].cos() + own.gravity_sin * angle[axis].sin();
        let speed = rate.abs() / own.stribeck_speed;
        let sliding = own.coulomb + own.stribeck * (-speed).exp() + own.load_coefficient * load.abs();
        let friction = (sliding + own.coulomb_asymmetry * rate.signum()) * sign(axis, rate) + own.viscous * rate;
        let needed = load + (own.motor_inertia + own.inertia_error) * acceleration + friction + own.offset;
        let lack = (1.0 + own.torque_constant_error) * torque[axis] - needed;
        // A torque constant scales the modelled torque: as a share of the measured one it could explain all of it.
        let mut row = vec![lack, sign(axis, rate), rate, 1.0, acceleration, -needed];
        row.extend(common.iter().map(|torques| torques[axis]));
        // The local terms of the other axes do not act here.
        for other in 0..N {
            let own = [angle[axis].cos(), angle[axis].sin(), acceleration, -needed];
            row.extend(own.map(|term| if other == axis { term } else { 0.0 }));
        }
        row
    })
}

/// Mass of a load and its place in flange axes, from its mass and its first moments about `about`.
pub(super) fn load(values: &[f64], about: [f64; 3]) -> (f64, [f64; 3]) {
    (values[0], [0, 1, 2].map(|axis| about[axis] + values[1 + axis] / values[0]))
}

impl Cause {
    /// Returns whether a robot can have such values of the cause's terms; `about` is the place about which the load's
    /// moments count.
    pub(super) fn is_possible(&self, rig: &RobotRig, about: [f64; 3], values: &[f64]) -> bool {
        match self.kind {
            Kind::Load => {
                // The model may have a load that is not there, but no more than its last link.
                let own = rig.model.joints.last().map_or(0.0, |joint| joint.link.mass);
                let (mass, place) = load(values, about);
                let distance = place.iter().map(|own| own * own).sum::<f64>().sqrt();
                (-own..=HEAVIEST * rig.model.workspace.payload).contains(&mass) && distance <= FARTHEST
            }
            Kind::Tilt => values[0].hypot(values[1]) <= STEEPEST,
            Kind::Coupling(..) => values[..3].iter().all(|value| *value >= 0.0),
            Kind::Local => true,
        }
    }
}
