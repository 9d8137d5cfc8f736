//! The list of the stage functions: name, arguments, result and call of each, over any scalar. The tracer writes WGSL from
//! it, and the parity test calls it in f64.

use crate::arm_motion::{self, ArmMotion};
use crate::capture_ring::{self, Ring};
use crate::compensator::{self, Compensation};
use crate::contact::shell::{self, Relative, ShellTouch};
use crate::contact::{self, LatchState, Point, PointContact, PointState};
use crate::fields::{Bundle, Field, bundle_name, fields};
use crate::fixture;
use crate::grip::{self, Grip};
use crate::guidance;
use crate::impedance::{self, Admittance};
use crate::joint_level;
use crate::load::{self, Load};
use crate::manipulator::cell::{self, Drives, SetPoint};
use crate::material::Pair;
use crate::mesh::ShellPoint;
use crate::metrics::Metrics;
use crate::monitor::{self, Touch, Watch};
use crate::noise::{self, Normals};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::robot::{self, Robots};
use crate::sensor::{self, Sensor};
use crate::session::{self, Asked, Clearance, Observed, Session};
use crate::space::{self, Actuation, Bodies, Kinematics, Masses, Parts, Wrench};
use crate::start;
use crate::test_motion::{self, Followed, Tracking};
use crate::thrusters::{self, Firing};

/// A bundle as a list of fields.
#[derive(Clone, Debug)]
pub struct BundleShape {
    /// Name of the bundle; that of the scalar for a bare one.
    pub name: &'static str,
    /// Its fields.
    pub fields: Vec<Field>,
}

/// Returns the shape of a bundle.
pub fn shape_of<R, B: Bundle<R>>() -> BundleShape {
    BundleShape { name: bundle_name::<B>(), fields: fields::<R, B>() }
}

/// A stage over flat lists of scalars.
pub type StageCall<'m, R> = Box<dyn Fn(&[R]) -> Vec<R> + 'm>;

/// One stage function.
pub struct StageRow<'m, R> {
    /// Its name in the WGSL.
    pub name: String,
    /// Names and shapes of its arguments.
    pub arguments: Vec<(&'static str, BundleShape)>,
    /// What it returns.
    pub result: BundleShape,
    /// The call: the fields of all arguments, one after the other, to the fields of the result.
    pub call: StageCall<'m, R>,
}

/// A row of the list: scalar; name, arguments and result; the call.
#[macro_export]
macro_rules! stage {
    ($scalar:ty; $name:ident($($argument:ident: $ty:ty),*) -> $result:ty => $body:expr) => {
        $crate::stages::StageRow {
            name: stringify!($name).to_owned(),
            arguments: vec![$((stringify!($argument), $crate::stages::shape_of::<$scalar, $ty>())),*],
            result: $crate::stages::shape_of::<$scalar, $result>(),
            call: Box::new(move |inputs: &[$scalar]| {
                let mut inputs = inputs.iter().copied();
                let mut _next = || inputs.next().expect("one scalar per field");
                $(let $argument = <$ty as $crate::fields::Bundle<$scalar>>::read(&mut _next);)*
                let result: $result = $body;
                $crate::fields::to_vec::<$scalar, _>(&result)
            }),
        }
    };
}

/// Every stage function of a scenario, in the order of the loop.
pub fn stages<R: Real, const N: usize>(m: &Plant) -> Vec<StageRow<'_, R>> {
    let mut all = body_stages::<R, N>(m);
    all.extend(contact_stages(m));
    all.extend(shell_stages(m));
    all.extend(facility_stages(m));
    if m.cells.is_some() {
        all.extend(joint_stages(m));
    }
    all.extend(monitor_stages::<R, N>(m));
    all
}

fn body_stages<R: Real, const N: usize>(m: &Plant) -> Vec<StageRow<'_, R>> {
    vec![
        stage!(R; space_masses(p: Params<R>) -> Masses<R> => space::space_masses(&p)),
        stage!(R; hil_masses(p: Params<R>) -> Masses<R> => space::hil_masses(&p)),
        stage!(R; start(p: Params<R>, masses: Masses<R>) -> Bodies<R, N> => start::start(m, &p, &masses)),
        stage!(R; kinematics(masses: Masses<R>, s: Bodies<R, N>) -> Kinematics<R, N> => space::kinematics(m, &masses, &s)),
        stage!(R; parts_of(k: Kinematics<R, N>) -> Parts<R> => k.parts),
        stage!(R; guide(p: Params<R>, masses: Masses<R>, s: Bodies<R, N>, k: Kinematics<R, N>, watch: Watch<R>, motion: ArmMotion<R, N>, firing: Firing<R>)
            -> Actuation<R, N> => guidance::guide(m, &p, &masses, &s.arm, &s.drives, s.chaser.attitude, &k, monitor::touched(&watch), &motion, &firing)),
        stage!(R; no_firing() -> Firing<R> => thrusters::no_firing()),
        stage!(R; fire(firing: Firing<R>, s: Bodies<R, N>, k: Kinematics<R, N>, watch: Watch<R>)
            -> Firing<R> => thrusters::fire(m, &firing, s.chaser.attitude, &k, monitor::touched(&watch))),
        stage!(R; no_motion() -> ArmMotion<R, N> => arm_motion::no_motion()),
        stage!(R; follow(p: Params<R>, motion: ArmMotion<R, N>, s: Bodies<R, N>, k: Kinematics<R, N>, felt: Wrench<R>, watch: Watch<R>, noise: Wrench<R>)
            -> ArmMotion<R, N> => arm_motion::follow(m, &p, &motion, &s.arm, &s.drives, s.chaser.attitude, &k, &felt, watch.closed, &noise)),
        stage!(R; feel(felt: Wrench<R>, parts: Parts<R>, w: Wrench<R>) -> Wrench<R> => arm_motion::feel(m, &felt, parts.a, w)),
        stage!(R; ring_at(parts: Parts<R>) -> Ring<R> => capture_ring::ring_at(m, &parts)),
        stage!(R; on_ring(ring: Ring<R>, parts: Parts<R>) -> Parts<R> => capture_ring::on_ring(m, &ring, &parts)),
        stage!(R; push_ring(ring: Ring<R>, parts: Parts<R>, w: Wrench<R>) -> Ring<R> => capture_ring::push_ring(m, &ring, &parts, w)),
        stage!(R; back_of(ring: Ring<R>) -> Wrench<R> => ring.back),
        stage!(R; settle_ring(ring: Ring<R>) -> Ring<R> => capture_ring::settle_ring(m, &ring)),
        stage!(R; advance(masses: Masses<R>, s: Bodies<R, N>, k: Kinematics<R, N>, u: Actuation<R, N>, w: Wrench<R>, back: Wrench<R>)
            -> Bodies<R, N> => {
            let mut next = s;
            space::advance_in_place(m, &masses, &mut next, &k, &u, w, back);
            next
        }),
        stage!(R; settle(s: Bodies<R, N>) -> Bodies<R, N> => space::settle(s)),
    ]
}

/// Name of a stage function that a law of contact has for itself: that of the first has no number.
pub fn of_law(name: &str, law: usize) -> String {
    if law == 0 { name.to_owned() } else { format!("{name}_{law}") }
}

/// Name of a stage function without the number of its law, finger or shell.
pub fn base_name(name: &str) -> &str {
    match name.rsplit_once('_') {
        Some((base, number)) if number.bytes().all(|byte| byte.is_ascii_digit()) => base,
        _ => name,
    }
}

fn contact_stages<R: Real>(m: &Plant) -> Vec<StageRow<'_, R>> {
    let laws = m.pairs.iter().enumerate().flat_map(|(law, of)| {
        let functions = [
            stage!(R; space_pair(p: Params<R>) -> Pair<R> => contact::space_pair(of, &p)),
            stage!(R; hil_pair(p: Params<R>) -> Pair<R> => contact::hil_pair(of, &p)),
            stage!(R; contact_point(pair: Pair<R>, parts: Parts<R>, point: Point<R>, state: PointState<R>)
                -> PointContact<R> => contact::contact_point(m, of, &pair, &parts, point, state)),
        ];
        functions.map(|function| StageRow { name: of_law(&function.name, law), ..function })
    });
    let fingers = m.contact.fingers.iter().enumerate().flat_map(|(index, finger)| {
        let functions = [
            stage!(R; with_finger(parts: Parts<R>, grip: Grip<R>) -> Parts<R> => contact::with_finger(finger, &parts, &grip)),
            stage!(R; of_finger(parts: Parts<R>, grip: Grip<R>, c: PointContact<R>) -> PointContact<R>
                => contact::of_finger(finger, &parts, &grip, &c)),
        ];
        let power = stage!(R; finger_power(parts: Parts<R>, grip: Grip<R>, c: PointContact<R>) -> R
            => contact::finger_power(finger, &parts, &grip, &c));
        let functions = functions.into_iter().chain([power]);
        functions.map(move |function| StageRow { name: of_law(&function.name, index), ..function }).collect::<Vec<_>>()
    });
    let mut all: Vec<StageRow<'_, R>> = laws.chain(fingers).collect();
    all.extend([
        stage!(R; latch(p: Params<R>, parts: Parts<R>, closed: R, gripped: R) -> LatchState<R>
            => contact::latch(m, &p, &parts, closed, gripped)),
        stage!(R; grip_after(grip: Grip<R>, time: R) -> Grip<R> => grip::grip_after(&grip, time)),
        stage!(R; no_touch() -> Touch<R> => monitor::no_touch()),
        stage!(R; gather(sum: Touch<R>, c: PointContact<R>) -> Touch<R> => monitor::gather(&sum, &c)),
        stage!(R; total_wrench(touch: Touch<R>, latch: LatchState<R>) -> Wrench<R> => monitor::total_wrench(&touch, &latch)),
    ]);
    all
}

/// Name of a stage function that a shell has for itself: that of the first has no number.
pub fn of_shell(name: &str, shell: usize) -> String {
    of_law(name, shell)
}

fn shell_stages<R: Real>(m: &Plant) -> Vec<StageRow<'_, R>> {
    let shells = m.shells.iter().enumerate().flat_map(|(index, shell)| {
        let of = &m.pairs[shell.pair];
        let functions = [
            stage!(R; relative(parts: Parts<R>) -> Relative<R> => shell::relative(m, shell, &parts)),
            stage!(R; shell_point(pair: Pair<R>, relative: Relative<R>, point: ShellPoint<R>, before: R, sum: ShellTouch<R>)
                -> ShellTouch<R> => shell::shell_point(m, of, &pair, &relative, &point, before, &sum)),
            stage!(R; shell_contact(pair: Pair<R>, parts: Parts<R>, relative: Relative<R>, sum: ShellTouch<R>, state: PointState<R>)
                -> PointContact<R> => shell::shell_contact(m, of, &pair, &parts, &relative, &sum, &state)),
        ];
        functions.map(|function| StageRow { name: of_shell(&function.name, index), ..function })
    });
    let mut all: Vec<StageRow<'_, R>> = shells.collect();
    if !all.is_empty() {
        all.push(stage!(R; no_shell_touch() -> ShellTouch<R> => shell::no_shell_touch()));
    }
    all
}

fn facility_stages<R: Real>(m: &Plant) -> Vec<StageRow<'_, R>> {
    vec![
        stage!(R; transport(p: Params<R>, time: R) -> R => robot::transport(m, &p, time)),
        stage!(R; progress(p: Params<R>, share: R) -> R => robot::progress(m, &p, share)),
        stage!(R; command(parts: Parts<R>) -> Parts<R> => robot::command(m, &parts)),
        stage!(R; with_test(p: Params<R>, reference: Parts<R>, time: R) -> Parts<R>
            => test_motion::with_test(m, &p, &reference, time)),
        stage!(R; step_admittance(s: Admittance<R>, parts: Parts<R>, w: Wrench<R>) -> Admittance<R>
            => impedance::step_admittance(m, &s, parts.a, w)),
        stage!(R; displaced(reference: Parts<R>, s: Admittance<R>) -> Parts<R> => impedance::displaced(m, &reference, &s)),
        stage!(R; no_admittance() -> Admittance<R> => impedance::no_admittance()),
        stage!(R; track(p: Params<R>, s: Tracking<R>, parts: Parts<R>, time: R) -> Tracking<R>
            => test_motion::track(m, &p, &s, &parts, time)),
        stage!(R; no_tracking() -> Tracking<R> => test_motion::no_tracking()),
        stage!(R; followed(p: Params<R>, s: Tracking<R>) -> Followed<R> => test_motion::followed(m, &p, &s)),
        stage!(R; extrapolate(parts: Parts<R>, periods: R) -> Parts<R> => robot::extrapolate(m, &parts, periods)),
        stage!(R; substitute(last: Parts<R>, lost_before: R) -> Parts<R> => robot::substitute(m, &last, lost_before)),
        stage!(R; interpolate(first: Parts<R>, second: Parts<R>, third: Parts<R>, place: R) -> Parts<R>
            => robot::interpolate(m, &first, &second, &third, place)),
        stage!(R; by_differences(first: Parts<R>, second: Parts<R>, third: Parts<R>) -> Parts<R>
            => robot::by_differences(m, &first, &second, &third)),
        stage!(R; on_course(p: Params<R>, reference: Parts<R>) -> Parts<R> => robot::on_course(m, &p, &reference)),
        stage!(R; robots_at(reference: Parts<R>) -> Robots<R> => robot::robots_at(m, &reference)),
        stage!(R; robots(p: Params<R>, s: Robots<R>, reference: Parts<R>) -> Robots<R> => robot::robots(m, &p, &s, &reference)),
        stage!(R; push_fixture(p: Params<R>, s: Robots<R>, w: Wrench<R>) -> Robots<R>
            => fixture::push_fixture(m, &p, &s, w)),
        stage!(R; mounted_parts(p: Params<R>, s: Robots<R>) -> Parts<R> => robot::mounted_parts(m, &p, &s)),
        stage!(R; to_sensor(parts: Parts<R>, w: Wrench<R>) -> Wrench<R> => sensor::to_sensor(parts.a, w)),
        stage!(R; low_pass(p: Params<R>, s: Sensor<R>, w: Wrench<R>) -> Sensor<R> => sensor::low_pass(m, &p, &s, w)),
        stage!(R; sample(p: Params<R>, s: Sensor<R>, time: R, noise: Wrench<R>) -> Sensor<R>
            => sensor::sample(m, &p, &s, time, noise)),
        stage!(R; carry(s: Load<R>, parts: Parts<R>) -> Load<R> => load::carry(m, &s, parts.a)),
        stage!(R; felt(s: Load<R>, parts: Parts<R>, w: Wrench<R>) -> Wrench<R> => load::felt(m, &s, parts.a, w)),
        stage!(R; without_load(p: Params<R>, s: Load<R>, parts: Parts<R>, sensor: Sensor<R>) -> Sensor<R>
            => load::without_load(m, &p, &s, parts.a, &sensor)),
        stage!(R; load_at(p: Params<R>, reference: Parts<R>) -> Load<R> => load::load_at(m, &p, reference.a)),
        stage!(R; sensor_at(s: Load<R>, reference: Parts<R>) -> Sensor<R> => load::sensor_at(m, &s, reference.a)),
        stage!(R; output_of(s: Sensor<R>) -> Wrench<R> => s.output),
        stage!(R; wrench_age(p: Params<R>) -> R => sensor::wrench_age(m, &p)),
        stage!(R; blend(newer: Wrench<R>, older: Wrench<R>, age: R) -> Wrench<R> => sensor::blend(newer, older, age)),
        stage!(R; feed_back(parts: Parts<R>, w: Wrench<R>) -> Wrench<R> => sensor::feed_back(parts.a, w)),
        stage!(R; new_session() -> Session<R> => session::new_session()),
        stage!(R; axes_asked(reference: Parts<R>) -> Asked<R> => session::axes_asked(m, &reference)),
        stage!(R; range_used(asked: Asked<R>, reference: Parts<R>) -> R => session::range_used(m, &asked, &reference)),
        stage!(R; far_apart() -> Clearance<R> => session::far_apart()),
        stage!(R; clearance(asked: Asked<R>, reference: Parts<R>) -> Clearance<R> => session::clearance(m, &asked, &reference)),
        stage!(R; supervise(s: Session<R>, parts: Parts<R>, commanded: Parts<R>, asked: Asked<R>, range_used: R,
            apart: Clearance<R>, w: Wrench<R>, sensed: Sensor<R>, port_energy: R, cycle: R) -> Session<R> => {
            let (saturated, cut, clearance) = (sensed.saturated, R::lit(0.0), apart);
            let seen =
                Observed { parts, commanded, wrench: w, saturated, cut, asked, range_used, clearance, port_energy };
            session::supervise(m, &s, &seen, cycle)
        }),
        stage!(R; new_compensation() -> Compensation<R> => compensator::new_compensation()),
        stage!(R; prediction_horizon(p: Params<R>) -> R => compensator::prediction_horizon(m, &p)),
        stage!(R; compensate(p: Params<R>, s: Compensation<R>, parts: Parts<R>, past: Parts<R>, w: Wrench<R>)
            -> Compensation<R> => compensator::compensate(m, &p, &s, &parts, &past, w)),
        stage!(R; acting_of(s: Compensation<R>) -> Wrench<R> => s.output),
        stage!(R; normals(u: R, v: R) -> Normals<R> => noise::normals(u, v)),
    ]
}

fn joint_stages<R: Real>(m: &Plant) -> Vec<StageRow<'_, R>> {
    let [robot1, robot2] = m.robots();
    vec![
        stage!(R; set_point1(p: Params<R>, s: Drives<R>, last: SetPoint<R>, reference: Parts<R>) -> SetPoint<R>
            => cell::set_point(robot1, &p.robot1, &s, &last, &reference.a)),
        stage!(R; set_point2(p: Params<R>, s: Drives<R>, last: SetPoint<R>, reference: Parts<R>) -> SetPoint<R>
            => cell::set_point(robot2, &p.robot2, &s, &last, &reference.b)),
        stage!(R; drive1(p: Params<R>, s: Drives<R>, aim: SetPoint<R>, load: Wrench<R>) -> Drives<R>
            => cell::drive(robot1, &p.robot1, &s, &aim, load)),
        stage!(R; drive2(p: Params<R>, s: Drives<R>, aim: SetPoint<R>, load: Wrench<R>) -> Drives<R>
            => cell::drive(robot2, &p.robot2, &s, &aim, load)),
        stage!(R; drives_at1(p: Params<R>, reference: Parts<R>) -> Drives<R> => cell::drives_at(robot1, &p.robot1, &reference.a)),
        stage!(R; drives_at2(p: Params<R>, reference: Parts<R>) -> Drives<R> => cell::drives_at(robot2, &p.robot2, &reference.b)),
        stage!(R; held_parts(s: Robots<R>, drives1: Drives<R>, drives2: Drives<R>) -> Robots<R>
            => joint_level::held_parts(m, &s, &drives1, &drives2)),
        stage!(R; reaction(parts: Parts<R>, w: Wrench<R>) -> Wrench<R> => joint_level::reaction(&parts, w)),
        stage!(R; first_set_point(s: Drives<R>) -> SetPoint<R> => cell::first_set_point(&s)),
    ]
}

fn monitor_stages<R: Real, const N: usize>(m: &Plant) -> Vec<StageRow<'_, R>> {
    vec![
        stage!(R; new_watch() -> Watch<R> => monitor::new_watch()),
        stage!(R; port_power(parts: Parts<R>, w: Wrench<R>) -> R => monitor::port_power(&parts, w)),
        stage!(R; observe(s: Watch<R>, time: R, parts: Parts<R>, simulated: Parts<R>, touch: Touch<R>, latch: LatchState<R>)
            -> Watch<R> => monitor::observe(m, &s, time, &parts, &simulated, &touch, &latch)),
        stage!(R; finish(s: Watch<R>, time: R, simulated: Parts<R>, last: R, facility: R)
            -> Watch<R> => monitor::finish(m, &s, time, &simulated, last, facility)),
        stage!(R; metrics(s: Watch<R>, bodies: Bodies<R, N>, ring: Ring<R>, followed: Followed<R>, facility: R) -> Metrics<R>
            => monitor::metrics(m, &s, &bodies, &ring, &followed, facility)),
    ]
}
