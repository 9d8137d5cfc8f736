//! What a lane keeps from tick to tick: the table of its variables, and everything that is derived from it.
//!
//! A row is a private variable of the kernel and its place in a [`Tile`]. Declarations, loads and stores of the kernel, the
//! rows of the state buffer, and a tile's way to flat numbers and back follow from the rows.

use super::{Tile, arms::Arms};
use crate::arm_motion::ArmMotion;
use crate::capture_ring::{Ring, has_ring};
use crate::compensator::{Compensation, compensates};
use crate::contact::{PointState, hil_pair, space_pair};
use crate::effects::EffectId;
use crate::fields::{Bundle, Field, bundle_name, fields, from_slice, join, to_vec};
use crate::frame::facility_lanes::SidePair;
use crate::frame::{Batch, has_plan};
use crate::impedance::Admittance;
use crate::lanes::Lane;
use crate::load::{Load, loaded};
use crate::manipulator::cell::{Drives, SetPoint};
use crate::material::NormalLaw;
use crate::monitor::Watch;
use crate::outcome::EndState;
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::{LinkCounts, Robots};
use crate::sensor::Sensor;
use crate::session::{Session, supervised};
use crate::space::{Bodies, Parts, Wrench, hil_masses, space_masses};
use crate::staged::kinematics;
use crate::test_motion::Tracking;
use crate::thrusters::Firing;

/// A variable of a lane.
#[derive(Clone, Debug)]
pub struct StateVariable {
    /// Name of the kernel's private variable.
    pub name: String,
    /// Name of its struct.
    pub structure: String,
    /// Its numbers, and whether each is kept between two slices: one that stays 0 in this plant is not.
    pub fields: Vec<(bool, Field)>,
}

impl StateVariable {
    fn of<B: Bundle<f64>>(m: &Plant, name: impl Into<String>, is_kept: bool) -> Self {
        let can_move = |field: &Field| field.effect.is_none_or(|effect| m.effects.has(EffectId::of(effect)));
        let of = |field: Field| (is_kept && can_move(&field), field);
        Self {
            name: name.into(),
            structure: bundle_name::<B>().to_owned(),
            fields: fields::<f64, B>().into_iter().map(of).collect(),
        }
    }
}

/// Declares the variables of a lane: `name: type, if the plant keeps it => its place;`, then those of the joint level.
macro_rules! lane_state {
    (
        ($m:ident, $space:ident, $hil:ident, $facility:ident, $arms:ident);
        { $($name:ident: $ty:ty $(, if $is_kept:expr)? => $place:expr;)* }
        joint level { $($joint:ident: $joint_ty:ty => $joint_place:expr;)* }
    ) => {
        /// The variables of a lane besides its contacts, in the order of the state buffer.
        fn table<const N: usize>($m: &Plant) -> Vec<StateVariable> {
            type L = f64;
            let has_joints = $m.cells.is_some();
            vec![
                $(StateVariable::of::<$ty>($m, stringify!($name), true $(&& $is_kept)?),)*
                $(StateVariable::of::<$joint_ty>($m, stringify!($joint), has_joints),)*
            ]
        }

        /// The variables of all lanes by their names in the kernel; those of the joint level have none here.
        struct Named<'a, L: Lane, const N: usize> {
            $($name: &'a $ty,)*
        }

        impl<L: Lane, const N: usize> Tile<L, N> {
            fn named(&self) -> Named<'_, L, N> {
                let Self { space: $space, hil: $hil, facility: $facility } = self;
                Named { $($name: &$place,)* }
            }
        }

        impl<const N: usize> Tile<f64, N> {
            /// The numbers of the table, kept or not.
            fn numbers(&self) -> Vec<f64> {
                let mut out = Vec::new();
                let (named, idle) = (self.named(), Arms::idle());
                let $arms = self.facility.arms.as_deref().unwrap_or(&idle);
                $(out.extend(to_vec::<f64, _>(named.$name));)*
                $(out.extend(to_vec::<f64, _>(&$joint_place));)*
                out
            }

            /// Takes the numbers of the table back.
            fn restore(&mut self, values: &mut &[f64]) {
                let Self { space: $space, hil: $hil, facility: $facility } = self;
                let mut idle = Arms::idle();
                $($place = take(values);)*
                let $arms = $facility.arms.as_deref_mut().unwrap_or(&mut idle);
                $($joint_place = take(values);)*
            }
        }
    };
}

lane_state! {
    (m, space, hil, facility, arms);
    {
        space: Bodies<L, N> => space.bodies;
        space_watch: Watch<L> => space.interface.watch;
        hil: Bodies<L, N> => hil.bodies;
        hil_watch: Watch<L> => hil.interface.watch;
        robot: Robots<L> => facility.robots;
        sensed: Sensor<L> => facility.sensor;
        held: Wrench<L> => facility.held;
        link: LinkCounts<L> => facility.link;
        tracking: Tracking<L> => facility.tracking;
        admittance: Admittance<L> => facility.admittance;
        load: Load<L>, if loaded(m) => facility.load;
        session: Session<L>, if supervised(m) => facility.session;
        compensation: Compensation<L>, if compensates(m) => facility.compensation;
        space_motion: ArmMotion<L, N>, if has_plan(m) => space.motion;
        hil_motion: ArmMotion<L, N>, if has_plan(m) => hil.motion;
        space_firing: Firing<L>, if m.guidance.thrusters.is_some() => space.firing;
        hil_firing: Firing<L>, if m.guidance.thrusters.is_some() => hil.firing;
        space_felt: Wrench<L>, if has_plan(m) => space.felt;
        hil_felt: Wrench<L>, if has_plan(m) => hil.felt;
        space_ring: Ring<L>, if has_ring(m) => space.interface.ring;
        hil_ring: Ring<L>, if has_ring(m) => hil.interface.ring;
    }
    joint level {
        drives_a: Drives<L> => arms.drives[0];
        drives_b: Drives<L> => arms.drives[1];
        set_a: SetPoint<L> => arms.set[0];
        set_b: SetPoint<L> => arms.set[1];
        push: Wrench<L> => arms.push;
    }
}

/// Declares where the end state of a run stands in the variables of a lane.
macro_rules! end_state {
    ($($field:ident: $variable:ident.$member:ident;)*) => {
        impl<L: Lane, const N: usize> Tile<L, N> {
            /// State of all lanes at the end of their runs.
            pub(super) fn end_state(&self) -> EndState<L> {
                let named = self.named();
                EndState { $($field: named.$variable.$member,)* }
            }
        }

        /// The kernel's expressions of the fields of [`EndState`], in their order.
        pub fn end_state_members() -> Vec<String> {
            let rows = [$((stringify!($field), concat!(stringify!($variable), ".", stringify!($member))),)*];
            let of = |field: &Field| {
                // `rule_measure` begins as `rule` does, and is none of its components.
                let named = rows.iter().filter(|(row, _)| field.name.starts_with(row));
                let (row, member) = named.max_by_key(|(row, _)| row.len()).expect("the compiler has seen its row");
                format!("{member}{}", &field.name[row.len()..])
            };
            fields::<f64, EndState<f64>>().iter().map(of).collect()
        }
    };
}

end_state! {
    space_unstable: space_watch.unstable;
    space_contact_work: space_watch.contact_work;
    space_absorbed: space_watch.absorbed;
    hil_unstable: hil_watch.unstable;
    hil_end_speed: hil_watch.end_speed;
    rule: session.rule;
    rule_measure: session.value;
    saturated: sensed.saturated;
    limited: robot.limited;
    dropped: link.dropped;
    touch_normal: space_watch.normal;
    touch_lever: space_watch.lever;
}

/// Variables of the states of so many contacts: of the loop in space, then of the facility's.
pub fn contact_names(contacts: usize) -> Vec<String> {
    let of = |side: &'static str| (0..contacts).map(move |i| format!("{side}_contact_{i}"));
    of("space").chain(of("hil")).collect()
}

/// The variables of a lane, in the order of the state buffer; those of the joint level are there without one, not kept.
pub fn state_variables<const N: usize>(m: &Plant) -> Vec<StateVariable> {
    let laws = || m.touching_pairs().map(|pair| pair.law);
    let of = |(name, law): (String, NormalLaw)| {
        let mut variable = StateVariable::of::<PointState<f64>>(m, name, true);
        let is_kept = |field: &Field| field.name != "approach" || law.needs_approach();
        variable.fields.iter_mut().for_each(|(kept, field)| *kept &= is_kept(field));
        variable
    };
    let contacts = contact_names(m.contact_states()).into_iter().zip(laws().chain(laws()));
    let mut variables = table::<N>(m);
    let mut without = |prefix: &str| {
        let fields = variables.iter_mut().flat_map(|variable| &mut variable.fields);
        fields.for_each(|(kept, field)| *kept &= !field.name.starts_with(prefix));
    };
    if m.drives.is_empty() {
        without("drives_");
    }
    if m.guidance.plan.as_ref().is_none_or(|plan| plan.camera.is_none()) {
        ["image_age", "images_", "sight_"].into_iter().for_each(without);
    }
    variables.into_iter().chain(contacts.map(of)).collect()
}

/// The rows of a lane's state, in the order of the kernel's state buffer.
pub fn state_fields<const N: usize>(m: &Plant) -> Vec<Field> {
    all_fields::<N>(m).into_iter().filter_map(|(is_kept, field)| is_kept.then_some(field)).collect()
}

/// Every number of a lane, and whether it is kept.
fn all_fields<const N: usize>(m: &Plant) -> Vec<(bool, Field)> {
    let named = |variable: StateVariable| {
        let StateVariable { name, fields, .. } = variable;
        fields.into_iter().map(move |(is_kept, field)| (is_kept, Field { name: join(&name, &field.name), ..field }))
    };
    state_variables::<N>(m).into_iter().flat_map(named).collect()
}

/// The first numbers of a list as a bundle; the list goes on behind them.
fn take<B: Bundle<f64>>(values: &mut &[f64]) -> B {
    let (own, rest) = values.split_at(fields::<f64, B>().len());
    *values = rest;
    from_slice(own)
}

/// One run between two ticks, as the GPU's buffers hold a lane.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneState {
    /// The kept numbers of the variables, in the order of [`state_fields`].
    pub state: Vec<f64>,
    /// Commands slot by slot, then wrenches slot by slot.
    pub lines: Vec<f64>,
}

impl<const N: usize> Tile<f64, N> {
    /// A tile in the middle of a run.
    pub fn resume(m: &Plant, batch: Batch, run: u64, tick: u32, params: Params<f64>, lane: &LaneState) -> Self {
        let mut tile = Self::new(m, batch);
        tile.facility.runs[0] = Some(run);
        (tile.facility.params, tile.facility.tick, tile.facility.step) =
            (params, f64::from(tick), tick as usize % tile.facility.slots);
        // What is not kept is at rest.
        let mut kept = lane.state.iter().copied();
        let of = |(is_kept, _)| if is_kept { kept.next().expect("a number for every kept row") } else { 0.0 };
        let whole: Vec<f64> = all_fields::<N>(m).into_iter().map(of).collect();
        let mut numbers = &whole[..];
        tile.restore(&mut numbers);
        let parameters: [(_, SidePair<f64>); 2] =
            [(space_masses(&params), space_pair), (hil_masses(&params), hil_pair)];
        for (side, (masses, pair)) in [&mut tile.space, &mut tile.hil].into_iter().zip(parameters) {
            side.masses = masses;
            side.interface.pairs = m.pairs.iter().map(|of| pair(of, &params)).collect();
            side.kinematics = kinematics(m, &masses, &side.bodies);
            side.interface.grip = side.motion.grip;
            side.interface.states.iter_mut().for_each(|state| *state = take(&mut numbers));
        }
        let (commands, wrenches) = lane.lines.split_at(tile.facility.slots * fields::<f64, Parts<f64>>().len());
        for (slot, values) in commands.chunks(commands.len() / tile.facility.slots).enumerate() {
            tile.facility.commands.put(slot, &from_slice(values), true);
        }
        for (slot, values) in wrenches.chunks(wrenches.len() / tile.facility.slots).enumerate() {
            tile.facility.wrenches.put(slot, &from_slice(values), true);
        }
        tile
    }

    /// What the contacts keep: of the loop in space, and of the facility's.
    pub fn contact_states(&self) -> [Vec<PointState<f64>>; 2] {
        [&self.space, &self.hil].map(|side| side.interface.states.clone())
    }

    /// What [`resume`](Self::resume) needs to go on from here, besides run, tick and parameters.
    pub fn lane_state(&self, m: &Plant) -> LaneState {
        let states = self.contact_states().into_iter().flatten();
        let numbers = self.numbers().into_iter().chain(states.flat_map(|state| to_vec::<f64, _>(&state)));
        let kept = all_fields::<N>(m).into_iter().zip(numbers).filter_map(|((kept, _), value)| kept.then_some(value));
        let commands = (0..self.facility.slots).flat_map(|slot| to_vec(&self.facility.commands.at(slot, 0)));
        let wrenches = (0..self.facility.slots).flat_map(|slot| to_vec(&self.facility.wrenches.at(slot, 0)));
        LaneState { state: kept.collect(), lines: commands.chain(wrenches).collect() }
    }
}
