//! The twin table: every function of the kernels that is not the same text on both sides, and how far it may differ.

use super::blocks::REPLAY_FRAME;
use super::frame::{FRAME_ROWS, WRITTEN_OUT};
use super::integers::INTEGER_ROWS;
use super::samples::CASES;
use softdock_kernels::frame::functions::frame_functions;
use softdock_kernels::stages::base_name;
use softdock_tracer::kernel::kernel;
use std::collections::BTreeSet;

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

const COPIED: &str = "no arithmetic";

/// Every stage function of the kernels' list by its base name, what is allowed as in [`Row`], and why. The input sampler of
/// an argument is that of its bundle (`samples.rs`).
#[rustfmt::skip]
pub(crate) const STAGES: &[(&str, f64, &str)] = &[
    ("space_masses", 0.0, COPIED),
    ("hil_masses", 4.0, "two roundings"),
    ("start", 60.0, "a momentum from a twist at a lever of metres, an inertia inverted twice"),
    ("kinematics", 250.0, "the inverse of the inertia of base and arm, and velocities at the end of six levers"),
    ("parts_of", 0.0, COPIED),
    ("guide", 100.0, "differences of attitudes; inverse dynamics sum forces larger than the torques"),
    ("no_firing", 0.0, COPIED),
    ("fire", 4.0, "whole ticks, and an attitude that is copied"),
    ("no_motion", 0.0, COPIED),
    ("follow", 100.0, "the place of part B is a difference of positions; the move's form has a cube root"),
    ("feel", 8.0, "one rotation and a blend"),
    ("ring_at", 20.0, "momenta from a twist at a lever"),
    ("on_ring", 20.0, "a twist from momenta, at a lever"),
    ("push_ring", 400.0, "a stroke is a difference of lengths hundreds of times larger, and the force of a stop a multiple of it"),
    ("back_of", 0.0, COPIED),
    ("settle_ring", 2.0, "one sum"),
    ("advance", 30.0, "one step from given kinematics; the arm's accelerations come of a chain of six"),
    ("settle", 2.0, "one sum"),
    ("space_pair", 1.0, "properties of a pair, rounded to f32"),
    ("hil_pair", 4.0, "two roundings"),
    ("contact_point", 200.0, "the depth is a difference of positions hundreds of times larger"),
    ("latch", 40.0, "the gap is a difference of positions"),
    ("no_touch", 0.0, COPIED),
    ("gather", 2.0, "one sum"),
    ("grip_after", 2.0, "one sum"),
    ("total_wrench", 2.0, "one sum"),
    ("with_finger", 10.0, "one rotation and a sum"),
    ("of_finger", 10.0, "one rotation and a sum"),
    ("finger_power", 10.0, "one rotation and a product"),
    ("relative", 200.0, "a difference of positions hundreds of times larger"),
    ("shell_point", 400.0, "a depth between nodes whose distances are a hundred times larger"),
    ("shell_contact", 200.0, "quotients of sums"),
    ("no_shell_touch", 0.0, COPIED),
    ("transport", 400.0, "the age of a held command, a difference of two times"),
    ("progress", 0.0, COPIED),
    ("command", 4.0, "a difference times a share"),
    ("step_admittance", 20.0, "a row of six products"),
    ("displaced", 8.0, "a sum, a turn"),
    ("no_admittance", 0.0, COPIED),
    ("with_test", 60.0, "the sine of a phase of whole turns"),
    ("track", 60.0, "as with_test; differences of places"),
    ("no_tracking", 0.0, COPIED),
    ("followed", 20.0, "an arc tangent, roots, quotients"),
    ("extrapolate", 8.0, "a turn through a polynomial sine, normalised"),
    ("on_course", 60.0, "as extrapolate, over a delay that is a difference"),
    ("new_session", 0.0, COPIED),
    ("axes_asked", 100.0, "rates of a posture far from singular, from its lengths and turns"),
    ("range_used", 100.0, "angles of a posture"),
    ("far_apart", 0.0, COPIED),
    ("clearance", 8.0, "points of the links at the end of six turns, metres from the base"),
    ("supervise", 100.0, "the work of a wrench over a difference of places"),
    ("substitute", 8.0, "as extrapolate"),
    ("interpolate", 8.0, "a dozen products, normalised"),
    ("by_differences", 20.0, "differences of neighbours over a tick, which are exact"),
    ("robots_at", 0.0, "a rail along an axis, a share of a half: exact"),
    ("robots", 40.0, "an error of attitude and place, times the square of a bandwidth"),
    ("push_fixture", 20.0, "a step of a resonance"),
    ("mounted_parts", 4.0, "two sums"),
    ("to_sensor", 4.0, "a rotation"),
    ("low_pass", 6.0, "a division and a sum"),
    ("sample", 8.0, "a row of the crosstalk; a quantum where the rounding of the reading is undecided"),
    ("output_of", 0.0, COPIED),
    ("wrench_age", 4.0, "one sum, scaled"),
    ("blend", 5.0, "one interpolation"),
    ("feed_back", 4.0, "a rotation"),
    ("carry", 20.0, "a difference of velocities over a substep"),
    ("felt", 6.0, "a rotation and a lever"),
    ("without_load", 8.0, "a weight, estimated, off a measured one"),
    ("load_at", 200.0, "a tare is a small difference of weights"),
    ("sensor_at", 6.0, "a rotation and a lever"),
    ("new_compensation", 0.0, COPIED),
    ("prediction_horizon", 4.0, "one sum"),
    ("compensate", 1000.0, "differences of samples over a tick, of places over a delay"),
    ("acting_of", 0.0, COPIED),
    ("normals", 20.0, "a logarithm, a root, a sine of a whole turn"),
    ("set_point1", 200.0, "rates from the inverse of a Jacobian, accelerations from their difference over a tick"),
    ("set_point2", 200.0, "as set_point1"),
    ("drive1", 200.0, "accelerations of a chain of six behind springs; the ripple's angle counts thousands of radians"),
    ("drive2", 200.0, "as drive1"),
    ("held_parts", 100.0, "velocities at the end of six levers"),
    ("reaction", 6.0, "a cross product added to a moment"),
    ("drives_at1", 2000.0, "the share of the gravity feedforward taken off the torque that carries the weight"),
    ("drives_at2", 1000.0, "as drives_at1"),
    ("first_set_point", 0.0, COPIED),
    ("new_watch", 0.0, COPIED),
    ("port_power", 6.0, "a sum of six products"),
    ("observe", 8.0, "energies are sums of products"),
    ("finish", 20.0, "a relative speed; else copies chosen by comparisons"),
    ("metrics", 20000.0, "the momentum errors are differences of momenta thousands of times larger"),
];

/// Names of the functions that a WGSL text defines.
fn defined(text: &str) -> BTreeSet<String> {
    let heads = text.lines().filter_map(|line| line.strip_prefix("fn "));
    heads.map(|head| head.split('(').next().expect("a name").to_owned()).collect()
}

#[test]
fn every_kernel_function_has_a_row_and_every_row_a_function() {
    let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect::<BTreeSet<String>>();
    let mut traced = BTreeSet::new();
    for case in CASES.iter() {
        let functions = kernel(&case.plant, case.batch).functions;
        let names: BTreeSet<&str> = functions.iter().map(|function| function.name.as_str()).collect();
        assert_eq!(names.len(), functions.len(), "{}: a stage twice", case.name);
        traced.extend(names.into_iter().map(|name| base_name(name).to_owned()));
    }
    assert_eq!(traced, owned(STAGES.iter().map(|stage| stage.0).collect()), "stages against the table");
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
