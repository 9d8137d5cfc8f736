//! The stage functions as the WGSL frame calls them: each traced once, listed by name.

use crate::trace::Sym;
use crate::wgsl::{Function, Struct};
use softdock_kernels::arm_motion::{self, ArmMotion};
use softdock_kernels::capture_ring::{self, Ring};
use softdock_kernels::compensator::{self, Compensation};
use softdock_kernels::contact::mesh::ShellPoint;
use softdock_kernels::contact::shell::{self, Relative, ShellTouch};
use softdock_kernels::contact::{self, LatchState, Point, PointContact, PointState};
use softdock_kernels::fields::{Bundle, bundle_name, fields};
use softdock_kernels::fixture;
use softdock_kernels::grip::{self, Grip};
use softdock_kernels::impedance::{self, Admittance};
use softdock_kernels::joint_level;
use softdock_kernels::load::{self, Load};
use softdock_kernels::manipulator::cell::{self, Drives, SetPoint};
use softdock_kernels::material::Pair;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::monitor::{self, Touch, Watch};
use softdock_kernels::noise::{self, Normals};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::real::Real;
use softdock_kernels::robot::{self, LinkCounts, Robots};
use softdock_kernels::sensor::{self, Sensor};
use softdock_kernels::session::{self, Asked, Clearance, Observed, Session};
use softdock_kernels::space::{self, Actuation, Bodies, Kinematics, Masses, Parts, Wrench};
use softdock_kernels::test_motion::{self, Followed, Tracking};
use softdock_kernels::thrusters::{self, Firing};
use softdock_kernels::vector::Vec3;

/// The WGSL struct of a bundle, by the bundle's own name.
pub fn structure<B: Bundle<Sym>>() -> Struct {
    let name = bundle_name::<B>();
    let name = if name == "Sym" { "f32" } else { name };
    Struct { name: name.to_owned(), fields: fields::<Sym, B>() }
}

/// Traces one closure over named bundles.
macro_rules! stage {
    ($name:ident($($argument:ident: $ty:ty),*) -> $result:ty => $body:expr) => {{
        let arguments = vec![$((stringify!($argument).to_owned(), $crate::stages::structure::<$ty>())),*];
        let count = arguments.iter().map(|(_, s): &(String, $crate::wgsl::Struct)| s.fields.len()).sum();
        let graph = $crate::trace::trace(count, |inputs| {
            let mut inputs = inputs.iter().copied();
            let mut _next = || inputs.next().expect("one symbol per field");
            $(let $argument = <$ty as softdock_kernels::fields::Bundle<$crate::trace::Sym>>::read(&mut _next);)*
            let result: $result = $body;
            softdock_kernels::fields::to_vec::<$crate::trace::Sym, _>(&result)
        });
        $crate::wgsl::Function { name: stringify!($name).to_owned(), arguments, result: $crate::stages::structure::<$result>(), graph }
    }};
}

pub(crate) use stage;

/// The structs that the frame names, besides those of [`functions`].
pub fn structures<const N: usize>(m: &Plant) -> Vec<Struct> {
    let mut all = vec![
        structure::<Params<Sym>>(),
        structure::<Masses<Sym>>(),
        structure::<Pair<Sym>>(),
        structure::<Bodies<Sym, N>>(),
        structure::<Kinematics<Sym, N>>(),
        structure::<Actuation<Sym, N>>(),
        structure::<ArmMotion<Sym, N>>(),
        structure::<Firing<Sym>>(),
        structure::<Ring<Sym>>(),
        structure::<Parts<Sym>>(),
        structure::<Wrench<Sym>>(),
        structure::<Point<Sym>>(),
        structure::<Vec3<Sym>>(),
        structure::<PointState<Sym>>(),
        structure::<PointContact<Sym>>(),
        structure::<LatchState<Sym>>(),
        structure::<Touch<Sym>>(),
        structure::<Grip<Sym>>(),
        structure::<Watch<Sym>>(),
        structure::<Robots<Sym>>(),
        structure::<LinkCounts<Sym>>(),
        structure::<Sensor<Sym>>(),
        structure::<Load<Sym>>(),
        structure::<Session<Sym>>(),
        structure::<Asked<Sym>>(),
        structure::<Clearance<Sym>>(),
        structure::<Compensation<Sym>>(),
        structure::<Normals<Sym>>(),
        structure::<Admittance<Sym>>(),
        structure::<Tracking<Sym>>(),
        structure::<Followed<Sym>>(),
        structure::<Metrics<Sym>>(),
    ];
    if m.cells.is_some() {
        all.extend([structure::<Drives<Sym>>(), structure::<SetPoint<Sym>>()]);
    }
    if !m.shells.is_empty() {
        all.extend([structure::<ShellPoint<Sym>>(), structure::<Relative<Sym>>(), structure::<ShellTouch<Sym>>()]);
    }
    all
}

/// Every stage function of a scenario, in the order of the loop.
pub fn functions<const N: usize>(m: &Plant) -> Vec<Function> {
    let mut all = body_stages::<N>(m);
    all.extend(contact_stages(m));
    all.extend(shell_stages(m));
    all.extend(facility_stages(m));
    if m.cells.is_some() {
        all.extend(joint_stages(m));
    }
    all.extend(monitor_stages::<N>(m));
    all
}

fn body_stages<const N: usize>(m: &Plant) -> Vec<Function> {
    vec![
        stage!(space_masses(p: Params<Sym>) -> Masses<Sym> => space::space_masses(&p)),
        stage!(hil_masses(p: Params<Sym>) -> Masses<Sym> => space::hil_masses(&p)),
        stage!(start(p: Params<Sym>, masses: Masses<Sym>) -> Bodies<Sym, N> => softdock_kernels::start::start(m, &p, &masses)),
        stage!(kinematics(masses: Masses<Sym>, s: Bodies<Sym, N>) -> Kinematics<Sym, N> => space::kinematics(m, &masses, &s)),
        stage!(parts_of(k: Kinematics<Sym, N>) -> Parts<Sym> => k.parts),
        stage!(guide(p: Params<Sym>, masses: Masses<Sym>, s: Bodies<Sym, N>, k: Kinematics<Sym, N>, watch: Watch<Sym>, motion: ArmMotion<Sym, N>, firing: Firing<Sym>)
            -> Actuation<Sym, N> => softdock_kernels::guidance::guide(m, &p, &masses, &s.arm, &s.drives, s.chaser.attitude, &k, monitor::touched(&watch), &motion, &firing)),
        stage!(no_firing() -> Firing<Sym> => thrusters::no_firing()),
        stage!(fire(firing: Firing<Sym>, s: Bodies<Sym, N>, k: Kinematics<Sym, N>, watch: Watch<Sym>)
            -> Firing<Sym> => thrusters::fire(m, &firing, s.chaser.attitude, &k, monitor::touched(&watch))),
        stage!(no_motion() -> ArmMotion<Sym, N> => arm_motion::no_motion()),
        stage!(follow(p: Params<Sym>, motion: ArmMotion<Sym, N>, s: Bodies<Sym, N>, k: Kinematics<Sym, N>, felt: Wrench<Sym>, watch: Watch<Sym>, noise: Wrench<Sym>)
            -> ArmMotion<Sym, N> => arm_motion::follow(m, &p, &motion, &s.arm, &s.drives, s.chaser.attitude, &k, &felt, watch.closed, &noise)),
        stage!(feel(felt: Wrench<Sym>, parts: Parts<Sym>, w: Wrench<Sym>) -> Wrench<Sym> => arm_motion::feel(m, &felt, parts.a, w)),
        stage!(ring_at(parts: Parts<Sym>) -> Ring<Sym> => capture_ring::ring_at(m, &parts)),
        stage!(on_ring(ring: Ring<Sym>, parts: Parts<Sym>) -> Parts<Sym> => capture_ring::on_ring(m, &ring, &parts)),
        stage!(push_ring(ring: Ring<Sym>, parts: Parts<Sym>, w: Wrench<Sym>) -> Ring<Sym> => capture_ring::push_ring(m, &ring, &parts, w)),
        stage!(back_of(ring: Ring<Sym>) -> Wrench<Sym> => ring.back),
        stage!(settle_ring(ring: Ring<Sym>) -> Ring<Sym> => capture_ring::settle_ring(m, &ring)),
        stage!(advance(masses: Masses<Sym>, s: Bodies<Sym, N>, k: Kinematics<Sym, N>, u: Actuation<Sym, N>, w: Wrench<Sym>, back: Wrench<Sym>)
            -> Bodies<Sym, N> => {
            let mut next = s;
            space::advance_in_place(m, &masses, &mut next, &k, &u, w, back);
            next
        }),
        stage!(settle(s: Bodies<Sym, N>) -> Bodies<Sym, N> => space::settle(s)),
    ]
}

/// Name of a stage function that a law of contact has for itself: that of the first has no number.
pub fn of_law(name: &str, law: usize) -> String {
    if law == 0 { name.to_owned() } else { format!("{name}_{law}") }
}

fn contact_stages(m: &Plant) -> Vec<Function> {
    let laws = m.pairs.iter().enumerate().flat_map(|(law, of)| {
        let functions = [
            stage!(space_pair(p: Params<Sym>) -> Pair<Sym> => contact::space_pair(of, &p)),
            stage!(hil_pair(p: Params<Sym>) -> Pair<Sym> => contact::hil_pair(of, &p)),
            stage!(contact_point(pair: Pair<Sym>, parts: Parts<Sym>, point: Point<Sym>, state: PointState<Sym>)
                -> PointContact<Sym> => contact::contact_point(m, of, &pair, &parts, point, state)),
        ];
        functions.map(|function| Function { name: of_law(&function.name, law), ..function })
    });
    let fingers = m.contact.fingers.iter().enumerate().flat_map(|(index, finger)| {
        let functions = [
            stage!(with_finger(parts: Parts<Sym>, grip: Grip<Sym>) -> Parts<Sym> => contact::with_finger(finger, &parts, &grip)),
            stage!(of_finger(parts: Parts<Sym>, grip: Grip<Sym>, c: PointContact<Sym>) -> PointContact<Sym>
                => contact::of_finger(finger, &parts, &grip, &c)),
        ];
        let power = stage!(finger_power(parts: Parts<Sym>, grip: Grip<Sym>, c: PointContact<Sym>) -> Sym
            => contact::finger_power(finger, &parts, &grip, &c));
        let functions = functions.into_iter().chain([power]);
        functions.map(move |function| Function { name: of_law(&function.name, index), ..function }).collect::<Vec<_>>()
    });
    let mut all: Vec<Function> = laws.chain(fingers).collect();
    all.extend([
        stage!(latch(p: Params<Sym>, parts: Parts<Sym>, closed: Sym, gripped: Sym) -> LatchState<Sym>
            => contact::latch(m, &p, &parts, closed, gripped)),
        stage!(grip_after(grip: Grip<Sym>, time: Sym) -> Grip<Sym> => grip::grip_after(&grip, time)),
        stage!(no_touch() -> Touch<Sym> => monitor::no_touch()),
        stage!(gather(sum: Touch<Sym>, c: PointContact<Sym>) -> Touch<Sym> => monitor::gather(&sum, &c)),
        stage!(total_wrench(touch: Touch<Sym>, latch: LatchState<Sym>) -> Wrench<Sym> => monitor::total_wrench(&touch, &latch)),
    ]);
    all
}

/// Name of a stage function that a shell has for itself: that of the first has no number.
pub fn of_shell(name: &str, shell: usize) -> String {
    of_law(name, shell)
}

fn shell_stages(m: &Plant) -> Vec<Function> {
    let shells = m.shells.iter().enumerate().flat_map(|(index, shell)| {
        let of = &m.pairs[shell.pair];
        let functions = [
            stage!(relative(parts: Parts<Sym>) -> Relative<Sym> => shell::relative(m, shell, &parts)),
            stage!(shell_point(pair: Pair<Sym>, relative: Relative<Sym>, point: ShellPoint<Sym>, before: Sym, sum: ShellTouch<Sym>)
                -> ShellTouch<Sym> => shell::shell_point(m, of, &pair, &relative, &point, before, &sum)),
            stage!(shell_contact(pair: Pair<Sym>, parts: Parts<Sym>, relative: Relative<Sym>, sum: ShellTouch<Sym>, state: PointState<Sym>)
                -> PointContact<Sym> => shell::shell_contact(m, of, &pair, &parts, &relative, &sum, &state)),
        ];
        functions.map(|function| Function { name: of_shell(&function.name, index), ..function })
    });
    let mut all: Vec<Function> = shells.collect();
    if !all.is_empty() {
        all.push(stage!(no_shell_touch() -> ShellTouch<Sym> => shell::no_shell_touch()));
    }
    all
}

fn facility_stages(m: &Plant) -> Vec<Function> {
    vec![
        stage!(transport(p: Params<Sym>, time: Sym) -> Sym => robot::transport(m, &p, time)),
        stage!(progress(p: Params<Sym>, share: Sym) -> Sym => robot::progress(m, &p, share)),
        stage!(command(parts: Parts<Sym>) -> Parts<Sym> => robot::command(m, &parts)),
        stage!(with_test(p: Params<Sym>, reference: Parts<Sym>, time: Sym) -> Parts<Sym>
            => test_motion::with_test(m, &p, &reference, time)),
        stage!(step_admittance(s: Admittance<Sym>, parts: Parts<Sym>, w: Wrench<Sym>) -> Admittance<Sym>
            => impedance::step_admittance(m, &s, parts.a, w)),
        stage!(displaced(reference: Parts<Sym>, s: Admittance<Sym>) -> Parts<Sym> => impedance::displaced(m, &reference, &s)),
        stage!(no_admittance() -> Admittance<Sym> => impedance::no_admittance()),
        stage!(track(p: Params<Sym>, s: Tracking<Sym>, parts: Parts<Sym>, time: Sym) -> Tracking<Sym>
            => test_motion::track(m, &p, &s, &parts, time)),
        stage!(no_tracking() -> Tracking<Sym> => test_motion::no_tracking()),
        stage!(followed(p: Params<Sym>, s: Tracking<Sym>) -> Followed<Sym> => test_motion::followed(m, &p, &s)),
        stage!(extrapolate(parts: Parts<Sym>, periods: Sym) -> Parts<Sym> => robot::extrapolate(m, &parts, periods)),
        stage!(substitute(last: Parts<Sym>, lost_before: Sym) -> Parts<Sym> => robot::substitute(m, &last, lost_before)),
        stage!(interpolate(first: Parts<Sym>, second: Parts<Sym>, third: Parts<Sym>, place: Sym) -> Parts<Sym>
            => robot::interpolate(m, &first, &second, &third, place)),
        stage!(by_differences(first: Parts<Sym>, second: Parts<Sym>, third: Parts<Sym>) -> Parts<Sym>
            => robot::by_differences(m, &first, &second, &third)),
        stage!(on_course(p: Params<Sym>, reference: Parts<Sym>) -> Parts<Sym> => robot::on_course(m, &p, &reference)),
        stage!(robots_at(reference: Parts<Sym>) -> Robots<Sym> => robot::robots_at(m, &reference)),
        stage!(robots(p: Params<Sym>, s: Robots<Sym>, reference: Parts<Sym>) -> Robots<Sym> => robot::robots(m, &p, &s, &reference)),
        stage!(push_fixture(p: Params<Sym>, s: Robots<Sym>, w: Wrench<Sym>) -> Robots<Sym>
            => fixture::push_fixture(m, &p, &s, w)),
        stage!(mounted_parts(p: Params<Sym>, s: Robots<Sym>) -> Parts<Sym> => robot::mounted_parts(m, &p, &s)),
        stage!(to_sensor(parts: Parts<Sym>, w: Wrench<Sym>) -> Wrench<Sym> => sensor::to_sensor(parts.a, w)),
        stage!(low_pass(p: Params<Sym>, s: Sensor<Sym>, w: Wrench<Sym>) -> Sensor<Sym> => sensor::low_pass(m, &p, &s, w)),
        stage!(sample(p: Params<Sym>, s: Sensor<Sym>, time: Sym, noise: Wrench<Sym>) -> Sensor<Sym>
            => sensor::sample(m, &p, &s, time, noise)),
        stage!(carry(s: Load<Sym>, parts: Parts<Sym>) -> Load<Sym> => load::carry(m, &s, parts.a)),
        stage!(felt(s: Load<Sym>, parts: Parts<Sym>, w: Wrench<Sym>) -> Wrench<Sym> => load::felt(m, &s, parts.a, w)),
        stage!(without_load(p: Params<Sym>, s: Load<Sym>, parts: Parts<Sym>, sensor: Sensor<Sym>) -> Sensor<Sym>
            => load::without_load(m, &p, &s, parts.a, &sensor)),
        stage!(load_at(p: Params<Sym>, reference: Parts<Sym>) -> Load<Sym> => load::load_at(m, &p, reference.a)),
        stage!(sensor_at(s: Load<Sym>, reference: Parts<Sym>) -> Sensor<Sym> => load::sensor_at(m, &s, reference.a)),
        stage!(output_of(s: Sensor<Sym>) -> Wrench<Sym> => s.output),
        stage!(wrench_age(p: Params<Sym>) -> Sym => sensor::wrench_age(m, &p)),
        stage!(blend(newer: Wrench<Sym>, older: Wrench<Sym>, age: Sym) -> Wrench<Sym> => sensor::blend(newer, older, age)),
        stage!(feed_back(parts: Parts<Sym>, w: Wrench<Sym>) -> Wrench<Sym> => sensor::feed_back(parts.a, w)),
        stage!(new_session() -> Session<Sym> => session::new_session()),
        stage!(axes_asked(reference: Parts<Sym>) -> Asked<Sym> => session::axes_asked(m, &reference)),
        stage!(range_used(asked: Asked<Sym>, reference: Parts<Sym>) -> Sym => session::range_used(m, &asked, &reference)),
        stage!(far_apart() -> Clearance<Sym> => session::far_apart()),
        stage!(clearance(asked: Asked<Sym>, reference: Parts<Sym>) -> Clearance<Sym> => session::clearance(m, &asked, &reference)),
        stage!(supervise(s: Session<Sym>, parts: Parts<Sym>, commanded: Parts<Sym>, asked: Asked<Sym>, range_used: Sym,
            apart: Clearance<Sym>, w: Wrench<Sym>, sensed: Sensor<Sym>, port_energy: Sym, cycle: Sym) -> Session<Sym> => {
            let (saturated, cut, clearance) = (sensed.saturated, Sym::lit(0.0), apart);
            let seen =
                Observed { parts, commanded, wrench: w, saturated, cut, asked, range_used, clearance, port_energy };
            session::supervise(m, &s, &seen, cycle)
        }),
        stage!(new_compensation() -> Compensation<Sym> => compensator::new_compensation()),
        stage!(prediction_horizon(p: Params<Sym>) -> Sym => compensator::prediction_horizon(m, &p)),
        stage!(compensate(p: Params<Sym>, s: Compensation<Sym>, parts: Parts<Sym>, past: Parts<Sym>, w: Wrench<Sym>)
            -> Compensation<Sym> => compensator::compensate(m, &p, &s, &parts, &past, w)),
        stage!(acting_of(s: Compensation<Sym>) -> Wrench<Sym> => s.output),
        stage!(normals(u: Sym, v: Sym) -> Normals<Sym> => noise::normals(u, v)),
    ]
}

fn joint_stages(m: &Plant) -> Vec<Function> {
    let [robot1, robot2] = m.robots();
    vec![
        stage!(set_point1(p: Params<Sym>, s: Drives<Sym>, last: SetPoint<Sym>, reference: Parts<Sym>) -> SetPoint<Sym>
            => cell::set_point(robot1, &p.robot1, &s, &last, &reference.a)),
        stage!(set_point2(p: Params<Sym>, s: Drives<Sym>, last: SetPoint<Sym>, reference: Parts<Sym>) -> SetPoint<Sym>
            => cell::set_point(robot2, &p.robot2, &s, &last, &reference.b)),
        stage!(drive1(p: Params<Sym>, s: Drives<Sym>, aim: SetPoint<Sym>, load: Wrench<Sym>) -> Drives<Sym>
            => cell::drive(robot1, &p.robot1, &s, &aim, load)),
        stage!(drive2(p: Params<Sym>, s: Drives<Sym>, aim: SetPoint<Sym>, load: Wrench<Sym>) -> Drives<Sym>
            => cell::drive(robot2, &p.robot2, &s, &aim, load)),
        stage!(drives_at1(p: Params<Sym>, reference: Parts<Sym>) -> Drives<Sym> => cell::drives_at(robot1, &p.robot1, &reference.a)),
        stage!(drives_at2(p: Params<Sym>, reference: Parts<Sym>) -> Drives<Sym> => cell::drives_at(robot2, &p.robot2, &reference.b)),
        stage!(held_parts(s: Robots<Sym>, drives1: Drives<Sym>, drives2: Drives<Sym>) -> Robots<Sym>
            => joint_level::held_parts(m, &s, &drives1, &drives2)),
        stage!(reaction(parts: Parts<Sym>, w: Wrench<Sym>) -> Wrench<Sym> => joint_level::reaction(&parts, w)),
        stage!(first_set_point(s: Drives<Sym>) -> SetPoint<Sym> => cell::first_set_point(&s)),
    ]
}

fn monitor_stages<const N: usize>(m: &Plant) -> Vec<Function> {
    vec![
        stage!(new_watch() -> Watch<Sym> => monitor::new_watch()),
        stage!(port_power(parts: Parts<Sym>, w: Wrench<Sym>) -> Sym => monitor::port_power(&parts, w)),
        stage!(observe(s: Watch<Sym>, time: Sym, parts: Parts<Sym>, simulated: Parts<Sym>, touch: Touch<Sym>, latch: LatchState<Sym>)
            -> Watch<Sym> => monitor::observe(m, &s, time, &parts, &simulated, &touch, &latch)),
        stage!(finish(s: Watch<Sym>, time: Sym, simulated: Parts<Sym>, last: Sym, facility: Sym)
            -> Watch<Sym> => monitor::finish(m, &s, time, &simulated, last, facility)),
        stage!(metrics(s: Watch<Sym>, bodies: Bodies<Sym, N>, ring: Ring<Sym>, followed: Followed<Sym>, facility: Sym) -> Metrics<Sym>
            => monitor::metrics(m, &s, &bodies, &ring, &followed, facility)),
    ]
}
