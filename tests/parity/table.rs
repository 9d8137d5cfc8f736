//! The twin table: every function of the kernels that is not the same text on both sides, and how far it may differ.

use super::blocks::REPLAY_FRAME;
use super::frame::{FRAME_ROWS, WRITTEN_OUT};
use super::integers::INTEGER_ROWS;
use super::samples::CASES;
use softdock_kernels::arm_motion::{self, ArmMotion};
use softdock_kernels::capture_ring::{self, Ring};
use softdock_kernels::compensator::{self, Compensation};
use softdock_kernels::contact::mesh::ShellPoint;
use softdock_kernels::contact::shell::{self, Relative, ShellTouch};
use softdock_kernels::contact::{self, LatchState, Point, PointContact, PointState};
use softdock_kernels::fields::{Bundle, from_slice, to_vec};
use softdock_kernels::fixture;
use softdock_kernels::frame::functions::frame_functions;
use softdock_kernels::grip::{self, Grip};
use softdock_kernels::guidance;
use softdock_kernels::impedance::{self, Admittance};
use softdock_kernels::joint_level;
use softdock_kernels::load::{self, Load};
use softdock_kernels::manipulator::cell::{self, Drives, SetPoint};
use softdock_kernels::material::Pair;
use softdock_kernels::monitor::{self, Touch, Watch};
use softdock_kernels::noise;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::{self, Robots};
use softdock_kernels::sensor::{self, Sensor};
use softdock_kernels::session::{self, Asked, Clearance, Observed, Session};
use softdock_kernels::space::{self, Actuation, Bodies, Kinematics, Masses, Parts, Wrench};
use softdock_kernels::start;
use softdock_kernels::test_motion::{self, Followed, Tracking};
use softdock_kernels::thrusters::{self, Firing};
use softdock_tracer::kernel::kernel;
use std::collections::BTreeSet;

/// A stage's Rust text in f64, on flat inputs.
pub(crate) type Twin = fn(&Plant, &[f64]) -> Vec<f64>;

/// One function of the table.
pub(crate) struct Row<T> {
    /// Its name in the WGSL.
    pub(crate) name: &'static str,
    /// Allowed error over the largest size of the field among the samples, in f32 roundings (6.0e-8).
    pub(crate) allowed: f64,
    /// Reason of the bound.
    pub(crate) reason: &'static str,
    /// Its Rust twin.
    pub(crate) twin: T,
}

/// The next bundle of a list of scalars.
fn take<B: Bundle<f64>>(inputs: &mut &[f64]) -> B {
    let width = softdock_kernels::fields::fields::<f64, B>().len();
    let (own, rest) = inputs.split_at(width);
    *inputs = rest;
    from_slice(own)
}

/// Rows of stage functions: name and arguments, the call in f64, what is allowed and why.
macro_rules! stages {
    ($m:ident; $($name:ident($($argument:ident: $ty:ty),*) => $body:expr, $allowed:expr, $reason:expr;)*) => {
        vec![$(Row {
            name: stringify!($name),
            allowed: $allowed,
            reason: $reason,
            twin: (|$m: &Plant, _inputs: &[f64]| {
                let (_, mut _inputs) = ($m, _inputs);
                $(let $argument: $ty = take(&mut _inputs);)*
                to_vec::<f64, _>(&$body)
            }) as Twin,
        }),*]
    };
}

const COPIED: &str = "no arithmetic";
const LITERALS: &str = "properties of a pair, rounded to f32";

/// Every traced stage function; the input sampler of an argument is that of its bundle (`samples.rs`).
pub(crate) fn stage_rows<const N: usize>() -> Vec<Row<Twin>> {
    let mut rows = body_rows::<N>();
    rows.extend(contact_rows());
    rows.extend(law_rows().into_iter().flatten());
    rows.extend(finger_rows());
    rows.extend(shell_rows().into_iter().flatten());
    rows.extend(facility_rows());
    rows.extend(joint_rows());
    rows.extend(monitor_rows::<N>());
    rows
}

fn body_rows<const N: usize>() -> Vec<Row<Twin>> {
    stages! { m;
        space_masses(p: Params<f64>) => space::space_masses(&p), 0.0, COPIED;
        hil_masses(p: Params<f64>) => space::hil_masses(&p), 4.0, "two roundings";
        start(p: Params<f64>, masses: Masses<f64>) => start::start::<f64, N>(m, &p, &masses), 60.0, "a momentum from a twist at a lever of metres, an inertia inverted twice";
        kinematics(masses: Masses<f64>, s: Bodies<f64, N>) => space::kinematics(m, &masses, &s), 250.0, "the inverse of the inertia of base and arm, and velocities at the end of six levers";
        parts_of(k: Kinematics<f64, N>) => k.parts, 0.0, COPIED;
        guide(p: Params<f64>, masses: Masses<f64>, s: Bodies<f64, N>, k: Kinematics<f64, N>, watch: Watch<f64>, motion: ArmMotion<f64, N>, firing: Firing<f64>) => {
            guidance::guide(m, &p, &masses, &s.arm, &s.drives, s.chaser.attitude, &k, monitor::touched(&watch), &motion, &firing)
        }, 100.0, "differences of attitudes; inverse dynamics sum forces larger than the torques";
        no_firing() => thrusters::no_firing::<f64>(), 0.0, COPIED;
        fire(firing: Firing<f64>, s: Bodies<f64, N>, k: Kinematics<f64, N>, watch: Watch<f64>) => {
            thrusters::fire(m, &firing, s.chaser.attitude, &k, monitor::touched(&watch))
        }, 4.0, "whole ticks, and an attitude that is copied";
        no_motion() => arm_motion::no_motion::<f64, N>(), 0.0, COPIED;
        follow(p: Params<f64>, motion: ArmMotion<f64, N>, s: Bodies<f64, N>, k: Kinematics<f64, N>, felt: Wrench<f64>, watch: Watch<f64>, noise: Wrench<f64>) => {
            arm_motion::follow(m, &p, &motion, &s.arm, &s.drives, s.chaser.attitude, &k, &felt, watch.closed, &noise)
        }, 100.0, "the place of part B is a difference of positions; the move's form has a cube root";
        feel(felt: Wrench<f64>, parts: Parts<f64>, w: Wrench<f64>) => arm_motion::feel(m, &felt, parts.a, w), 8.0, "one rotation and a blend";
        ring_at(parts: Parts<f64>) => capture_ring::ring_at(m, &parts), 20.0, "momenta from a twist at a lever";
        on_ring(ring: Ring<f64>, parts: Parts<f64>) => capture_ring::on_ring(m, &ring, &parts), 20.0, "a twist from momenta, at a lever";
        push_ring(ring: Ring<f64>, parts: Parts<f64>, w: Wrench<f64>) => capture_ring::push_ring(m, &ring, &parts, w), 400.0, "a stroke is a difference of lengths hundreds of times larger, and the force of a stop a multiple of it";
        back_of(ring: Ring<f64>) => ring.back, 0.0, COPIED;
        settle_ring(ring: Ring<f64>) => capture_ring::settle_ring(m, &ring), 2.0, "one sum";
        advance(masses: Masses<f64>, s: Bodies<f64, N>, k: Kinematics<f64, N>, u: Actuation<f64, N>, w: Wrench<f64>, back: Wrench<f64>) => {
            let mut next = s;
            space::advance_in_place(m, &masses, &mut next, &k, &u, w, back);
            next
        }, 30.0, "one step from given kinematics; the arm's accelerations come of a chain of six";
        settle(s: Bodies<f64, N>) => space::settle(s), 2.0, "one sum";
    }
}

/// Rows of the laws of contact, whose functions each law has for itself.
macro_rules! laws {
    ($($law:literal, $allowed:literal, $reason:expr => $space:ident, $hil:ident, $point:ident;)*) => {
        vec![$(stages! { m;
            $space(p: Params<f64>) => contact::space_pair(&m.pairs[$law], &p), $allowed, $reason;
            $hil(p: Params<f64>) => contact::hil_pair(&m.pairs[$law], &p), 4.0, "two roundings";
            $point(pair: Pair<f64>, parts: Parts<f64>, point: Point<f64>, state: PointState<f64>)
                => contact::contact_point(m, &m.pairs[$law], &pair, &parts, point, state), 200.0, "the depth is a difference of positions hundreds of times larger";
        }),*]
    };
}

/// The rows of each law.
fn law_rows() -> Vec<Vec<Row<Twin>>> {
    laws! {
        0, 0.0, COPIED => space_pair, hil_pair, contact_point;
        1, 1.0, LITERALS => space_pair_1, hil_pair_1, contact_point_1;
        2, 1.0, LITERALS => space_pair_2, hil_pair_2, contact_point_2;
        3, 0.0, COPIED => space_pair_3, hil_pair_3, contact_point_3;
        4, 1.0, LITERALS => space_pair_4, hil_pair_4, contact_point_4;
        5, 0.0, COPIED => space_pair_5, hil_pair_5, contact_point_5;
        6, 0.0, COPIED => space_pair_6, hil_pair_6, contact_point_6;
        7, 0.0, COPIED => space_pair_7, hil_pair_7, contact_point_7;
    }
}

fn contact_rows() -> Vec<Row<Twin>> {
    stages! { m;
        latch(p: Params<f64>, parts: Parts<f64>, closed: f64, gripped: f64) => contact::latch(m, &p, &parts, closed, gripped), 40.0, "the gap is a difference of positions";
        no_touch() => monitor::no_touch::<f64>(), 0.0, COPIED;
        gather(sum: Touch<f64>, c: PointContact<f64>) => monitor::gather(&sum, &c), 2.0, "one sum";
        grip_after(grip: Grip<f64>, time: f64) => grip::grip_after(&grip, time), 2.0, "one sum";
        total_wrench(touch: Touch<f64>, latch: LatchState<f64>) => monitor::total_wrench(&touch, &latch), 2.0, "one sum";
    }
}

/// Rows of a finger of part A, which has functions of its own.
fn finger_rows() -> Vec<Row<Twin>> {
    stages! { m;
        with_finger(parts: Parts<f64>, grip: Grip<f64>) => contact::with_finger(&m.contact.fingers[0], &parts, &grip), 10.0, "one rotation and a sum";
        of_finger(parts: Parts<f64>, grip: Grip<f64>, c: PointContact<f64>) => contact::of_finger(&m.contact.fingers[0], &parts, &grip, &c), 10.0, "one rotation and a sum";
        finger_power(parts: Parts<f64>, grip: Grip<f64>, c: PointContact<f64>) => contact::finger_power(&m.contact.fingers[0], &parts, &grip, &c), 10.0, "one rotation and a product";
    }
}

/// Rows of the shells of meshes, whose functions each shell has for itself; the last are those of all.
macro_rules! shells {
    ($($shell:literal => $relative:ident, $point:ident, $contact:ident;)*) => {
        vec![$(stages! { m;
            $relative(parts: Parts<f64>) => shell::relative(m, &m.shells[$shell], &parts), 200.0, "a difference of positions hundreds of times larger";
            $point(pair: Pair<f64>, relative: Relative<f64>, point: ShellPoint<f64>, before: f64, sum: ShellTouch<f64>)
                => shell::shell_point(m, &m.pairs[m.shells[$shell].pair], &pair, &relative, &point, before, &sum), 400.0, "a depth between nodes whose distances are a hundred times larger";
            $contact(pair: Pair<f64>, parts: Parts<f64>, relative: Relative<f64>, sum: ShellTouch<f64>, state: PointState<f64>)
                => shell::shell_contact(m, &m.pairs[m.shells[$shell].pair], &pair, &parts, &relative, &sum, &state), 200.0, "quotients of sums";
        }),*]
    };
}

/// The rows of each shell, then of all.
fn shell_rows() -> Vec<Vec<Row<Twin>>> {
    let mut rows = shells! {
        0 => relative, shell_point, shell_contact;
        1 => relative_1, shell_point_1, shell_contact_1;
    };
    rows.push(stages! { _m; no_shell_touch() => shell::no_shell_touch::<f64>(), 0.0, COPIED; });
    rows
}

fn facility_rows() -> Vec<Row<Twin>> {
    stages! { m;
        transport(p: Params<f64>, time: f64) => robot::transport(m, &p, time), 400.0, "the age of a held command, a difference of two times";
        progress(p: Params<f64>, share: f64) => robot::progress(m, &p, share), 0.0, COPIED;
        command(parts: Parts<f64>) => robot::command(m, &parts), 4.0, "a difference times a share";
        step_admittance(s: Admittance<f64>, parts: Parts<f64>, w: Wrench<f64>) => impedance::step_admittance(m, &s, parts.a, w), 20.0, "a row of six products";
        displaced(reference: Parts<f64>, s: Admittance<f64>) => impedance::displaced(m, &reference, &s), 8.0, "a sum, a turn";
        no_admittance() => impedance::no_admittance::<f64>(), 0.0, COPIED;
        with_test(p: Params<f64>, reference: Parts<f64>, time: f64) => test_motion::with_test(m, &p, &reference, time), 60.0, "the sine of a phase of whole turns";
        track(p: Params<f64>, s: Tracking<f64>, parts: Parts<f64>, time: f64) => test_motion::track(m, &p, &s, &parts, time), 60.0, "as with_test; differences of places";
        no_tracking() => test_motion::no_tracking::<f64>(), 0.0, COPIED;
        followed(p: Params<f64>, s: Tracking<f64>) => test_motion::followed(m, &p, &s), 20.0, "an arc tangent, roots, quotients";
        extrapolate(parts: Parts<f64>, periods: f64) => robot::extrapolate(m, &parts, periods), 8.0, "a turn through a polynomial sine, normalised";
        on_course(p: Params<f64>, reference: Parts<f64>) => robot::on_course(m, &p, &reference), 60.0, "as extrapolate, over a delay that is a difference";
        new_session() => session::new_session::<f64>(), 0.0, COPIED;
        axes_asked(reference: Parts<f64>) => session::axes_asked(m, &reference), 100.0, "rates of a posture far from singular, from its lengths and turns";
        range_used(asked: Asked<f64>, reference: Parts<f64>) => session::range_used(m, &asked, &reference), 100.0, "angles of a posture";
        far_apart() => session::far_apart::<f64>(), 0.0, COPIED;
        clearance(asked: Asked<f64>, reference: Parts<f64>) => session::clearance(m, &asked, &reference), 8.0, "points of the links at the end of six turns, metres from the base";
        supervise(s: Session<f64>, parts: Parts<f64>, commanded: Parts<f64>, asked: Asked<f64>, range_used: f64, apart: Clearance<f64>, w: Wrench<f64>, sensed: Sensor<f64>, port_energy: f64, cycle: f64) => {
            let (saturated, cut, clearance) = (sensed.saturated, 0.0, apart);
            let seen = Observed { parts, commanded, wrench: w, saturated, cut, asked, range_used, clearance, port_energy };
            session::supervise(m, &s, &seen, cycle)
        }, 100.0, "the work of a wrench over a difference of places";
        substitute(last: Parts<f64>, lost_before: f64) => robot::substitute(m, &last, lost_before), 8.0, "as extrapolate";
        interpolate(first: Parts<f64>, second: Parts<f64>, third: Parts<f64>, place: f64)
            => robot::interpolate(m, &first, &second, &third, place), 8.0, "a dozen products, normalised";
        by_differences(first: Parts<f64>, second: Parts<f64>, third: Parts<f64>)
            => robot::by_differences(m, &first, &second, &third), 20.0, "differences of neighbours over a tick, which are exact";
        robots_at(reference: Parts<f64>) => robot::robots_at(m, &reference), 0.0, "a rail along an axis, a share of a half: exact";
        robots(p: Params<f64>, s: Robots<f64>, reference: Parts<f64>) => robot::robots(m, &p, &s, &reference), 40.0, "an error of attitude and place, times the square of a bandwidth";
        push_fixture(p: Params<f64>, s: Robots<f64>, w: Wrench<f64>)
            => fixture::push_fixture(m, &p, &s, w), 20.0, "a step of a resonance";
        mounted_parts(p: Params<f64>, s: Robots<f64>) => robot::mounted_parts(m, &p, &s), 4.0, "two sums";
        to_sensor(parts: Parts<f64>, w: Wrench<f64>) => sensor::to_sensor(parts.a, w), 4.0, "a rotation";
        low_pass(p: Params<f64>, s: Sensor<f64>, w: Wrench<f64>) => sensor::low_pass(m, &p, &s, w), 6.0, "a division and a sum";
        sample(p: Params<f64>, s: Sensor<f64>, time: f64, noise: Wrench<f64>) => sensor::sample(m, &p, &s, time, noise), 8.0, "a row of the crosstalk; a quantum where the rounding of the reading is undecided";
        output_of(s: Sensor<f64>) => s.output, 0.0, COPIED;
        wrench_age(p: Params<f64>) => sensor::wrench_age(m, &p), 4.0, "one sum, scaled";
        blend(newer: Wrench<f64>, older: Wrench<f64>, age: f64) => sensor::blend(newer, older, age), 5.0, "one interpolation";
        feed_back(parts: Parts<f64>, w: Wrench<f64>) => sensor::feed_back(parts.a, w), 4.0, "a rotation";
        carry(s: Load<f64>, parts: Parts<f64>) => load::carry(m, &s, parts.a), 20.0, "a difference of velocities over a substep";
        felt(s: Load<f64>, parts: Parts<f64>, w: Wrench<f64>) => load::felt(m, &s, parts.a, w), 6.0, "a rotation and a lever";
        without_load(p: Params<f64>, s: Load<f64>, parts: Parts<f64>, sensor: Sensor<f64>)
            => load::without_load(m, &p, &s, parts.a, &sensor), 8.0, "a weight, estimated, off a measured one";
        load_at(p: Params<f64>, reference: Parts<f64>) => load::load_at(m, &p, reference.a), 200.0, "a tare is a small difference of weights";
        sensor_at(s: Load<f64>, reference: Parts<f64>) => load::sensor_at(m, &s, reference.a), 6.0, "a rotation and a lever";
        new_compensation() => compensator::new_compensation::<f64>(), 0.0, COPIED;
        prediction_horizon(p: Params<f64>) => compensator::prediction_horizon(m, &p), 4.0, "one sum";
        compensate(p: Params<f64>, s: Compensation<f64>, parts: Parts<f64>, past: Parts<f64>, w: Wrench<f64>)
            => compensator::compensate(m, &p, &s, &parts, &past, w), 1000.0, "differences of samples over a tick, of places over a delay";
        acting_of(s: Compensation<f64>) => s.output, 0.0, COPIED;
        normals(u: f64, v: f64) => noise::normals(u, v), 20.0, "a logarithm, a root, a sine of a whole turn";
    }
}

/// The stages of the joint level, in kernels of robots with joints alone.
fn joint_rows() -> Vec<Row<Twin>> {
    stages! { m;
        set_point1(p: Params<f64>, s: Drives<f64>, last: SetPoint<f64>, reference: Parts<f64>)
            => cell::set_point(&m.robots()[0], &p.robot1, &s, &last, &reference.a), 200.0, "rates from the inverse of a Jacobian, accelerations from their difference over a tick";
        set_point2(p: Params<f64>, s: Drives<f64>, last: SetPoint<f64>, reference: Parts<f64>)
            => cell::set_point(&m.robots()[1], &p.robot2, &s, &last, &reference.b), 200.0, "as set_point1";
        drive1(p: Params<f64>, s: Drives<f64>, aim: SetPoint<f64>, load: Wrench<f64>)
            => cell::drive(&m.robots()[0], &p.robot1, &s, &aim, load), 200.0, "accelerations of a chain of six behind springs; the ripple's angle counts thousands of radians";
        drive2(p: Params<f64>, s: Drives<f64>, aim: SetPoint<f64>, load: Wrench<f64>)
            => cell::drive(&m.robots()[1], &p.robot2, &s, &aim, load), 200.0, "as drive1";
        held_parts(s: Robots<f64>, drives1: Drives<f64>, drives2: Drives<f64>)
            => joint_level::held_parts(m, &s, &drives1, &drives2), 100.0, "velocities at the end of six levers";
        reaction(parts: Parts<f64>, w: Wrench<f64>) => joint_level::reaction(&parts, w), 6.0, "a cross product added to a moment";
        drives_at1(p: Params<f64>, reference: Parts<f64>) => cell::drives_at(&m.robots()[0], &p.robot1, &reference.a), 2000.0, "the share of the gravity feedforward taken off the torque that carries the weight";
        drives_at2(p: Params<f64>, reference: Parts<f64>) => cell::drives_at(&m.robots()[1], &p.robot2, &reference.b), 1000.0, "as drives_at1";
        first_set_point(s: Drives<f64>) => cell::first_set_point(&s), 0.0, COPIED;
    }
}

fn monitor_rows<const N: usize>() -> Vec<Row<Twin>> {
    stages! { m;
        new_watch() => monitor::new_watch::<f64>(), 0.0, COPIED;
        port_power(parts: Parts<f64>, w: Wrench<f64>) => monitor::port_power(&parts, w), 6.0, "a sum of six products";
        observe(s: Watch<f64>, time: f64, parts: Parts<f64>, simulated: Parts<f64>, touch: Touch<f64>, latch: LatchState<f64>)
            => monitor::observe(m, &s, time, &parts, &simulated, &touch, &latch), 8.0, "energies are sums of products";
        finish(s: Watch<f64>, time: f64, simulated: Parts<f64>, last: f64, facility: f64)
            => monitor::finish(m, &s, time, &simulated, last, facility), 20.0, "a relative speed; else copies chosen by comparisons";
        metrics(s: Watch<f64>, bodies: Bodies<f64, N>, ring: Ring<f64>, followed: Followed<f64>, facility: f64)
            => monitor::metrics(m, &s, &bodies, &ring, &followed, facility), 20000.0, "the momentum errors are differences of momenta thousands of times larger";
    }
}

/// Names of the functions that a WGSL text defines.
fn defined(text: &str) -> BTreeSet<String> {
    let heads = text.lines().filter_map(|line| line.strip_prefix("fn "));
    heads.map(|head| head.split('(').next().expect("a name").to_owned()).collect()
}

#[test]
fn every_kernel_function_has_a_row_and_every_row_a_function() {
    let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect::<BTreeSet<String>>();
    let all = owned(stage_rows::<0>().iter().map(|row| row.name).collect());
    let of_joints = owned(joint_rows().iter().map(|row| row.name).collect());
    for case in CASES.iter() {
        let traced: Vec<String> =
            kernel(&case.plant, case.batch).functions.into_iter().map(|function| function.name).collect();
        let mut stages = if case.plant.cells.is_some() { all.clone() } else { &all - &of_joints };
        let others = law_rows().into_iter().skip(case.plant.pairs.len()).flatten();
        others.for_each(|row| assert!(stages.remove(row.name), "{}", row.name));
        let fingers = finger_rows().into_iter().filter(|_| case.plant.contact.fingers.is_empty());
        fingers.for_each(|row| assert!(stages.remove(row.name), "{}", row.name));
        let (mut shells, count) = (shell_rows(), case.plant.shells.len());
        let of_all = shells.pop().filter(|_| count == 0);
        let others = shells.into_iter().skip(count).chain(of_all).flatten();
        others.for_each(|row| assert!(stages.remove(row.name), "{}", row.name));
        assert_eq!(traced.len(), stages.len(), "a stage twice");
        assert_eq!(stages, traced.into_iter().collect(), "stages of {} against the table", case.name);
    }
    let frame = owned(FRAME_ROWS.iter().map(|row| row.name).collect());
    let mut by_hand = defined(include_str!("../../kernels/wgsl/frame.wgsl"));
    by_hand.extend(owned(WRITTEN_OUT.to_vec()));
    let lagging = defined(include_str!("../../kernels/wgsl/robots_lag.wgsl"));
    assert_eq!(lagging, defined(include_str!("../../kernels/wgsl/robots_joint.wgsl")), "both kinds of robots");
    by_hand.extend(lagging);
    assert_eq!(frame, by_hand, "frame.wgsl against the table");
    assert_eq!(frame, owned(frame_functions::<0>().iter().map(|f| f.0).collect()), "the Rust twins of the frame");
    let words = owned(INTEGER_ROWS.iter().map(|row| row.name).collect());
    let mut written = defined(include_str!("../../kernels/wgsl/philox.wgsl"));
    written.extend(defined(include_str!("../../kernels/wgsl/math.wgsl")));
    assert_eq!(words, written, "philox.wgsl and math.wgsl against the table");
    let replayed = defined(include_str!("../../kernels/wgsl/replay.wgsl"));
    assert_eq!(owned(REPLAY_FRAME.to_vec()), replayed, "replay.wgsl against what whole recordings test");
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels/wgsl");
    assert_eq!(std::fs::read_dir(folder).expect("kernels/wgsl").count(), 6, "a hand-written file without rows");
}
