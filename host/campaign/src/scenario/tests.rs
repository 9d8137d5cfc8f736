//! Scenarios compiled from texts, against values worked by hand.

use super::*;
use softdock_kernels::model::{Compensator, CompensatorKind, NormalLaw, Shape};
use softdock_kernels::vector::vec3;

/// A ball of 400 kg against a plane on a target of 400 kg.
pub(crate) const FREE_BODY: &str = r#"
schema = "scenario/2"
id = "ball"
title = "A ball against a plane"
[timing]
time_limit = "2 s"
[base]
mass = "400 kg"
inertia = { ixx = "60 kg m^2", iyy = "60 kg m^2", izz = "60 kg m^2" }
[part_a]
[[part_a.point]]
position = ["0 m", "0 m", "0 m"]
radius = "100 mm"
[target]
mass = "400 kg"
inertia = { ixx = "60 kg m^2", iyy = "60 kg m^2", izz = "60 kg m^2" }
[part_b]
[[part_b.solid]]
shape = "plane"
[contact]
law = "linear"
stiffness = "1e5 N/m"
[start]
gap = "150 mm"
closing_speed = "50 mm/s"
[facility]
session_rules = "none"
unstable_speed = "2 m/s"
[task]
capture = false
touch = true
max_depth = "50 mm"
"#;

pub(crate) fn scenario(text: &str) -> Result<Scenario, Problems> {
    Scenario::from_source(Source::new("test.toml".into(), text.to_owned()))
}

pub(crate) fn free_body() -> Model {
    scenario(FREE_BODY).expect("valid").model
}

#[test]
fn a_free_body_compiles() {
    let m = free_body();
    assert_eq!((m.timing.substep, m.timing.substeps, m.timing.max_ticks), (0.25e-3, 4, 2000));
    assert_eq!(m.base_pose.position, vec3(-0.15, 0.0, 0.0));
    assert_eq!(m.target_pose.position, vec3(0.0, 0.0, 0.0));
    assert_eq!(m.contact.law, NormalLaw::Linear);
    assert_eq!(m.contact.b.solids[0].shape, Shape::Plane);
    assert_eq!((m.nominal.base_mass, m.nominal.closing_speed), (400.0, 0.05));
    assert_eq!(m.nominal.loop_delay, m.timing.own_delay());
    assert!((m.nominal.bristle_stiffness - 2e5 / 3.0).abs() < 1e-9);
    // 2 x 0.7 x sqrt(2/3 K m) with m = 200 kg.
    assert!((m.nominal.bristle_damping - 1.4 * (2e5_f64 / 3.0 * 200.0).sqrt()).abs() < 1e-6);
}

#[test]
fn a_tilted_seat_still_puts_part_b_at_the_origin() {
    let text = FREE_BODY.replace(
        "[part_b]",
        "[part_b]\nposition = [\"1 m\", \"2 m\", \"3 m\"]\nrotation = [\"10 deg\", \"20 deg\", \"30 deg\"]",
    );
    let m = scenario(&text).expect("valid").model;
    let seat = m.target_pose.compose(m.seat);
    assert!(seat.position.norm() < 1e-14 && seat.attitude.v.norm() < 1e-14);
}

#[test]
fn restitution_sets_the_damping() {
    let text = FREE_BODY.replace("[start]", "restitution = 0.744079\n[start]");
    let m = scenario(&text).expect("valid").model;
    // zeta = 0.1 on 200 kg.
    let expected = 0.2 * (1e5_f64 * 200.0).sqrt();
    assert!((m.nominal.contact_damping / expected - 1.0).abs() < 1e-4, "{}", m.nominal.contact_damping);
}

fn first(old: &str, new: &str) -> Problem {
    assert!(FREE_BODY.contains(old), "{old}");
    let problems = scenario(&FREE_BODY.replace(old, new)).expect_err(new);
    problems.iter().next().expect("never empty").clone()
}

#[test]
fn a_contact_too_stiff_for_the_step_is_refused_with_the_step_that_would_do() {
    // sqrt(K/m) dt = sqrt(1e9 / 200) 0.25e-3 = 0.559; half would do at 0.2236 ms.
    let problem = first("1e5 N/m", "1e9 N/m");
    assert_eq!(problem.key, "contact.stiffness");
    assert!(problem.message.contains("0.559 rad") && problem.message.contains("200.0000 kg"), "{}", problem.message);
    assert!(problem.remedy.contains("timing.substep = \"2.23"), "{}", problem.remedy);
    let step: f64 =
        problem.remedy.split('"').nth(1).and_then(|s| s.split(' ').next()).expect("a step").parse().expect("a number");
    let does = FREE_BODY
        .replace("1e5 N/m", "1e9 N/m")
        .replace("[timing]", &format!("[timing]\nsubstep = \"{step} ms\"\ntick = \"{step} ms\""));
    scenario(&does).expect("the printed step does");
}

#[test]
fn a_delay_below_the_loops_own_is_refused_with_the_least() {
    let problem = first("[facility]", "[facility]\nloop_delay = \"0.2 ms\"\nsensor = { delay = \"1 ms\" }");
    assert_eq!(problem.key, "facility.loop_delay");
    assert!(problem.remedy.contains("\"1.375000 ms\""), "{}", problem.remedy);
}

#[test]
fn the_chaser_is_placed_once() {
    let problem = first("gap = \"150 mm\"\n", "");
    assert!(problem.remedy.contains("gap"), "{}", problem.remedy);
    let problem = first("[part_a]\n", "position = [\"0 m\", \"0 m\", \"0 m\"]\n[part_a]\n");
    assert_eq!(problem.key, "base.position");
}

/// The free body with more of a facility.
fn with_facility(text: &str) -> Result<Scenario, Problems> {
    scenario(&FREE_BODY.replace("[task]", &format!("{text}\n[task]")))
}

#[test]
fn a_compensator_takes_its_own_numbers_and_no_others() {
    let m = with_facility("[facility.compensator]\nkind = \"smith\"\ndelay = \"8 ms\"\nstiffness = \"9e4 N/m\"")
        .expect("valid")
        .model;
    assert_eq!(m.facility.compensator, Compensator { kind: CompensatorKind::Smith, pulls: false });
    assert_eq!((m.nominal.compensator_delay, m.nominal.compensator_stiffness), (8e-3, 9e4));
    assert_eq!(free_body().facility.compensator, Compensator::NONE);
    let refused = |text: &str, message: &str| {
        let problems = with_facility(&format!("[facility.compensator]\n{text}")).expect_err(text);
        assert!(format!("{problems:?}").contains(message), "{problems:?}");
    };
    refused("kind = \"smith\"\ndelay = \"8 ms\"", "needs the key `stiffness`");
    refused("kind = \"passivity\"\nenergy = \"0.1 J\"\nmargin = 0.1", "does not take the key `margin`");
    refused("kind = \"none\"\npulls = true", "does not take the key `pulls`");
    refused("kind = \"smit\"", "is not known here");
    // A model spring that the tick cannot follow: half a radian in 1 ms on 200 kg.
    refused("kind = \"smith\"\ndelay = \"8 ms\"\nstiffness = \"9e7 N/m\"", "compensator: stiffness");
}

#[test]
fn a_load_and_a_tare_compile_and_an_error_without_a_tare_is_refused() {
    let text = "[facility.sensor]\ntared = true\ntare_error_force = [\"0.1 N\", \"0 N\", \"0 N\"]\n\
                drift_moment = [\"0 N m/s\", \"0 N m/s\", \"0.3 N m/min\"]\n\
                load = { mass = \"12 kg\", centre = [\"80 mm\", \"0 m\", \"0 m\"], \
                gravity = [\"0 m/s^2\", \"0 m/s^2\", \"-9.81 m/s^2\"], mass_error = \"2 %\" }";
    let m = with_facility(text).expect("valid").model;
    let load = m.facility.load.expect("a load");
    assert!(m.facility.tared && load.inertia_compensated);
    assert_eq!((load.mass, load.centre, load.gravity.z), (12.0, vec3(0.08, 0.0, 0.0), -9.81));
    assert_eq!((m.nominal.load_mass_error, m.nominal.tare_error_force.x), (0.02, 0.1));
    assert!((m.nominal.sensor_drift_moment.z - 0.005).abs() < 1e-15);
    let untared = with_facility("[facility.sensor]\ntare_error_force = [\"0.1 N\", \"0 N\", \"0 N\"]");
    assert!(format!("{:?}", untared.expect_err("no tare")).contains("the sensor is not tared"));
}

/// The shipped docking on robots with joints, changed in one place.
fn on_joints(old: &str, new: &str) -> Result<Scenario, Problems> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios/smoke_joint.toml");
    let text = std::fs::read_to_string(&path).expect("a shipped scenario");
    assert!(text.contains(old), "{old}");
    Scenario::from_source(Source::new(path, text.replacen(old, new, 1)))
}

#[test]
fn robots_with_joints_take_what_a_facility_can_be() {
    let m = on_joints("", "").expect("valid").model;
    let level = m.facility.joint_level.expect("joints");
    let carriage = level.carriage.expect("a rail");
    assert_eq!(carriage.joint.link.mass, 1200.0);
    assert!((carriage.joint.drive.reflected_inertia() - 0.006 * (std::f64::consts::TAU / 8e-3).powi(2)).abs() < 1e-6);
    let refused = |old: &str, new: &str, key: &str, message: &str| {
        let problems = on_joints(old, new).expect_err(new);
        let problem = problems.iter().next().expect("never empty");
        assert_eq!(problem.key, key, "{problem}");
        assert!(problem.message.contains(message), "{problem}");
    };
    let rail = "rail = { axis = [1, 0, 0], share = 0.5 }";
    refused(rail, "", "facility.joint_level.rail", "this drive has no rail");
    refused(rail, "rail = { axis = [1, 0, 1], share = 0.5 }", "facility.joint_level.rail", "this one climbs");
    let lagging = "rail = { axis = [1, 0, 0], share = 0.5, lag = \"10 ms\" }";
    refused(rail, lagging, "facility.rail.lag", "this does nothing beside [facility.joint_level]");
    let heavy = "payload = { mass = \"340 kg\",";
    refused("payload = { mass = \"40 kg\",", heavy, "facility.joint_level.robot1", "more than the 300 kg");
    let far = "[facility.joint_level.robot1]      # holds the probe\nposition = [\"-4 m\"";
    let near = "[facility.joint_level.robot1]      # holds the probe\nposition = [\"-2 m\"";
    refused(near, far, "facility.joint_level.robot1", "robot 1 cannot hold its part");
    // 5e8 N m s/rad on the reflected rotor of axis 1, 609 kg m^2, cannot be followed in 0.25 ms.
    let gains = "facility.joint_level.servo.velocity_gain";
    refused(
        "velocity_gain = [\"3e5 N m s/rad\"",
        "velocity_gain = [\"5e8 N m s/rad\"",
        gains,
        "velocity loop of joint 1",
    );
    refused("velocity_gain = \"4e5 N s/m\"", "velocity_gain = \"4e8 N s/m\"", gains, "velocity loop of the rail");
}

/// The ball with its own contact law against the plane.
fn with_pair(text: &str) -> String {
    let named = FREE_BODY
        .replace("[[part_a.point]]\n", "[[part_a.point]]\nname = \"ball\"\n")
        .replace("shape = \"plane\"", "name = \"wall\"\nshape = \"plane\"");
    named.replace("[start]", &format!("[[contact.pair]]\n{text}\n[start]"))
}

const WALL: &str = "a = [\"ball\"]\nb = [\"wall\"]\n";

#[test]
fn a_pair_has_its_own_law_and_properties() {
    let of = |text: &str| scenario(&with_pair(&format!("{WALL}{text}"))).expect("valid").model.contact.pairs[0].clone();
    let row = of("law = \"linear\"\nstiffness = \"2e4 N/m\"\nrestitution = 0.744079\nfriction = 0.2\nstribeck = 0.4");
    assert_eq!((row.a.points, row.b.solids), (vec![0], vec![0]));
    // zeta = 0.1 on 200 kg.
    assert!((row.properties.damping - 0.2 * (2e4_f64 * 200.0).sqrt()).abs() < 0.1);
    assert_eq!((row.properties.friction, row.properties.stribeck, row.properties.stribeck_speed), (0.2, 0.4, 0.01));
    assert!((row.properties.bristle_stiffness - 2.0 / 3.0 * 2e4).abs() < 1e-9);

    // Steel on steel, R = 100 mm: 4/3 E* sqrt(R) with E* = 210 GPa / (2 (1 - 0.3^2)).
    let steel = "youngs_modulus = [\"210 GPa\", \"210 GPa\"]\npoisson = [0.3, 0.3]\nradius = \"100 mm\"";
    let stiff =
        with_pair(&format!("{WALL}law = \"hertz\"\n{steel}")).replace("max_depth = \"50 mm\"", "max_depth = \"1 mm\"");
    let hertz = scenario(&stiff).err().map(|problems| problems.to_string()).unwrap_or_default();
    assert!(hertz.contains("contact pair 1"), "the step cannot follow steel: {hertz}");
    let fine = stiff.replace("[timing]\n", "[timing]\nsubstep = \"1 us\"\ntick = \"1 ms\"\n");
    let row = scenario(&fine).expect("valid").model.contact.pairs[0].clone();
    let right = 4.0 / 3.0 * 210e9 / (2.0 * (1.0 - 0.09)) * 0.1_f64.sqrt();
    assert!((row.properties.stiffness / right - 1.0).abs() < 1e-12, "{}", row.properties.stiffness);
    assert_eq!(row.law, NormalLaw::Power { exponent: 1.5 });

    let rebound = |law: &str| {
        let row = of(&format!("law = \"{law}\"\nstiffness = \"1e5 N/m\"\nexponent = 1\nrestitution = 0.8"));
        assert_eq!(row.law, NormalLaw::Rebound { exponent: 1.0, slowest: 5e-3 });
        row.properties.dissipation * 5e-3
    };
    assert!((rebound("lankarani_nikravesh") - 0.27).abs() < 1e-12);
    assert!((rebound("flores") - 0.4).abs() < 1e-12);
    assert!((rebound("rebound") - 0.37315).abs() < 1e-5);
}

#[test]
fn faults_of_a_pair_come_with_line_and_remedy() {
    let first = |text: &str| scenario(&with_pair(text)).expect_err("refused").iter().next().expect("one").clone();
    let law = "law = \"linear\"\nstiffness = \"1e4 N/m\"\n";
    let problem = first(&format!("a = [\"bal\"]\n{law}"));
    assert!(problem.message.contains("nothing of part_a has the name `bal`"), "{}", problem.message);
    assert!(problem.remedy.contains("write one of: ball"), "{:?}", problem.remedy);
    let problem = first(&format!("{WALL}{law}[[contact.pair]]\n{law}"));
    assert!(problem.message.contains("is together in `[[contact.pair]]` 1 too"), "{}", problem.message);
    let problem = first(&format!("{WALL}{law}stroke = \"1 mm\""));
    assert!(problem.message.contains("`linear` does not take the key `stroke`"), "{}", problem.message);
    let problem = first(&format!("{WALL}law = \"stop\"\nstiffness = \"1e4 N/m\"\nstroke = \"1 mm\""));
    assert!(problem.message.contains("`stop` needs the key `stop_stiffness`"), "{}", problem.message);
    let problem = first(&format!("{WALL}law = \"flores\"\nstiffness = \"1e4 N/m\""));
    assert!(problem.message.contains("`flores` needs the key `restitution`"), "{}", problem.message);
    let problem = first(&format!("{WALL}law = \"linear\"\nstiffness = \"1e9 N/m\""));
    assert!(problem.message.contains("contact pair 1"), "{}", problem.message);
    assert_eq!(problem.key, "contact.pair[1].stiffness");
}

#[test]
fn both_parts_have_points_and_solids() {
    let text = FREE_BODY
        .replace(
            "[target]",
            "[[part_a.solid]]\nname = \"pin\"\nshape = \"capsule\"\nradius = \"5 mm\"\nlength = \"60 mm\"\n[target]",
        )
        .replace("[contact]", "[[part_b.point]]\nname = \"tip\"\nposition = [\"0 m\", \"0.5 m\", \"0 m\"]\n[contact]")
        .replace(
            "[start]",
            "[[contact.pair]]\na = [\"pin\"]\nb = [\"tip\"]\nlaw = \"linear\"\nstiffness = \"1e4 N/m\"\n[start]",
        );
    let m = scenario(&text).expect("valid").model;
    assert_eq!(m.contact.a.solids[0].shape, Shape::Capsule { radius: 0.005, length: 0.06, points: 2 });
    assert_eq!((m.contact.pairs[0].a.solids.clone(), m.contact.pairs[0].b.points.clone()), (vec![0], vec![0]));
    // The ball and both ends of the pin on the plane; the tip on the pin.
    assert_eq!(crate::overlap::without_robots(&m).contacts.len(), 4);
    let alone = FREE_BODY.replace("[[part_a.point]]\nposition = [\"0 m\", \"0 m\", \"0 m\"]\nradius = \"100 mm\"", "");
    let problems = scenario(&alone).expect_err("no points").to_string();
    assert!(problems.contains("no contact point of one part meets a solid of the other"), "{problems}");
}

/// The free body without the mass and the inertia of a table, which is held.
fn with_held(text: &str, table: &str) -> String {
    let bodies = "mass = \"400 kg\"\ninertia = { ixx = \"60 kg m^2\", iyy = \"60 kg m^2\", izz = \"60 kg m^2\" }\n";
    let written = format!("[{table}]\n{bodies}");
    assert!(text.contains(&written), "{table}");
    text.replace(&written, &format!("[{table}]\nheld = true\n"))
}

#[test]
fn a_held_body_needs_no_mass_and_a_free_one_does() {
    let target = scenario(&with_held(FREE_BODY, "target")).expect("a held target").model;
    assert_eq!((target.held.base, target.held.target), (false, true));
    // 2 x 0.7 x sqrt(2/3 K m): the effective mass is that of the ball alone.
    assert!((target.nominal.bristle_damping - 1.4 * (2e5_f64 / 3.0 * 400.0).sqrt()).abs() < 1e-6);
    let base = scenario(&with_held(FREE_BODY, "base")).expect("a held base").model;
    assert_eq!((base.held.base, base.held.target), (true, false));
    assert_eq!(base.nominal.bristle_damping, target.nominal.bristle_damping);
    for table in ["base", "target"] {
        let held = with_held(FREE_BODY, table);
        let free = scenario(&held.replace("held = true", "held = false")).expect_err("a free body without mass");
        let keys: Vec<&str> = free.iter().map(|problem| problem.key.as_str()).collect();
        assert_eq!(keys, [format!("{table}.mass"), format!("{table}.inertia")]);
        let both = scenario(&held.replace("held = true", "held = true\nmass = \"3 kg\"")).expect_err("a mass");
        assert_eq!(both.iter().next().expect("a problem").key, format!("{table}.mass"));
    }
}

#[test]
fn keys_that_do_nothing_on_a_held_body_are_refused() {
    let key = |text: String| {
        let problems = scenario(&text).expect_err("refused");
        problems.iter().map(|problem| problem.key.clone()).collect::<Vec<_>>()
    };
    let (base, target) = (with_held(FREE_BODY, "base"), with_held(FREE_BODY, "target"));
    let rate = "[\"0 rad/s\", \"0.1 rad/s\", \"0 rad/s\"]";
    let in_start = |text: &str, line: &str| text.replace("[start]", &format!("[start]\n{line}"));
    assert_eq!(key(in_start(&base, &format!("chaser_rate = {rate}"))), ["start.chaser_rate"]);
    assert_eq!(key(in_start(&target, &format!("target_rate = {rate}"))), ["start.target_rate"]);
    scenario(&in_start(&base, &format!("target_rate = {rate}"))).expect("the target is free");
    let field = "[field]\nacceleration = [\"0 m/s^2\", \"0 m/s^2\", \"-9.81 m/s^2\"]\n[start]";
    assert_eq!(key(base.replace("[start]", field)), ["field.acceleration"]);
    let both = with_held(&base, "target");
    assert_eq!(key(both), ["start.closing_speed", "target.held"]);
    let effect = "[[effect]]\nid = \"P1_mass\"\nparameters = { mass_error = 0.1 }\n[start]";
    let problems = scenario(&target.replace("[start]", effect)).expect_err("an effect on a held target");
    assert!(problems.iter().any(|p| p.message.contains("the target is held")), "{:?}", problems.iter().next());
}

const THRUSTERS: &str = "[base.thrusters]\ntorque = [\"1 N m\", \"2 N m\", \"0 N m\"]\ndeadband = \"0.5 deg\"\nlead = \"4 s\"\n\
                         pulse = \"20 ms\"\n[part_a]\n";

#[test]
fn thrusters_are_read_and_those_that_do_nothing_are_refused() {
    let with = |text: &str| FREE_BODY.replace("[part_a]\n", text);
    let m = scenario(&with(THRUSTERS)).unwrap_or_else(|problems| panic!("{problems}")).model;
    let own = m.guidance.thrusters.expect("thrusters");
    assert_eq!((own.torque, own.pulse, own.off_at_touch), (vec3(1.0, 2.0, 0.0), 20, false));
    assert!((own.deadband - 0.5_f64.to_radians()).abs() < 1e-15 && own.lead == 4.0);
    let cases = [
        ("pulse = \"20 ms\"", "pulse = \"20.5 ms\"", "not a whole number of ticks"),
        ("\"1 N m\", \"2 N m\"", "\"0 N m\", \"0 N m\"", "the thrusters have no torque"),
        ("deadband = \"0.5 deg\"", "deadband = \"0 deg\"", "out of range"),
        ("\"2 N m\"", "\"2 N\"", "this is a force"),
    ];
    for (old, new, what) in cases {
        let problems = scenario(&with(&THRUSTERS.replace(old, new))).expect_err(new);
        assert!(problems.to_string().contains(what), "{new}: {problems}");
    }
    let problems = scenario(&with_held(&with(THRUSTERS), "base")).expect_err("a held base");
    assert!(problems.to_string().contains("a held base has nothing to turn"), "{problems}");
}

const RING: &str = "[soft_capture]\nmass = \"20 kg\"\ninertia = { ixx = \"2 kg m^2\", iyy = \"1.2 kg m^2\", izz = \"1.2 kg m^2\" }\n\
                    radius = [\"0.3 m\", \"0.4 m\"]\nhalf_angle = [\"10 deg\", \"12 deg\"]\nplace = [\"0 mm\", \"300 mm\"]\n\
                    turn = \"30 deg\"\nstiffness = \"2 kN/m\"\ndamping = \"80 N s/m\"\nforce_limit = \"300 N\"\nlag = \"4 ms\"\n\
                    shortening = \"150 mm\"\nlengthening = \"90 mm\"\nstop_stiffness = \"50 kN/m\"\n[part_a]\n";

#[test]
fn a_capture_ring_is_read_and_one_that_cannot_be_is_refused() {
    let with = |text: &str| FREE_BODY.replace("[part_a]\n", text);
    let m = scenario(&with(RING)).unwrap_or_else(|problems| panic!("{problems}")).model;
    let own = m.ring.expect("a ring");
    assert_eq!((own.mass, own.stiffness, own.force_limit, own.strokes), (20.0, 2e3, 300.0, [0.15, 0.09]));
    // The first joint at 30 - 10 degrees from the y axis, that of the mount at 30 - 60 + 12 degrees.
    let leg = own.legs[0];
    let at =
        |x: f64, radius: f64, angle: f64| vec3(x, radius * angle.to_radians().cos(), radius * angle.to_radians().sin());
    assert!((leg.ring - at(0.0, 0.3, 20.0)).norm() < 1e-12, "{leg:?}");
    assert!((leg.mount - at(0.3, 0.4, -18.0)).norm() < 1e-12, "{leg:?}");
    assert_eq!(crate::ring_notes::ring_lines(&m).len(), 3);
    let cases = [
        ("shortening = \"150 mm\"", "shortening = \"350 mm\"", "cannot shorten by 350.0 mm"),
        ("radius = [\"0.3 m\", \"0.4 m\"]", "radius = [\"0.3 m\"]", "radius"),
        ("half_angle = [\"10 deg\"", "half_angle = [\"70 deg\"", "out of range"),
        ("mass = \"20 kg\"", "mass = \"0 kg\"", "out of range"),
        ("ixx = \"2 kg m^2\"", "ixx = \"9 kg m^2\"", "no rigid body has this inertia"),
        ("stop_stiffness = \"50 kN/m\"", "stop_stiffness = \"1e10 N/m\"", "soft capture ring: stiffness"),
        ("damping = \"80 N s/m\"", "damping = \"1e5 N s/m\"", "soft capture ring: damping"),
        ("[part_a]\n", "[orbit]\nrate = \"1e-3 rad/s\"\n[part_a]\n", "relative gravity does not act"),
    ];
    for (old, new, what) in cases {
        let problems = scenario(&with(&RING.replace(old, new))).expect_err(new);
        assert!(problems.to_string().contains(what), "{new}: {problems}");
    }
}

const LATCH: &str = "[latch]\npoint = [\"0 m\", \"0 m\", \"0 m\"]\nseat = [\"0 m\", \"0 m\", \"0 m\"]\ndepth = \"5 mm\"\n\
                     offset = \"5 mm\"\nangle = \"2 deg\"\nspeed = \"0.1 m/s\"\nstiffness = \"1 kN/m\"\ndamping = \"10 N s/m\"\n\
                     rotation_stiffness = \"0 N m/rad\"\nrotation_damping = \"0 N m s/rad\"\n";

#[test]
fn hooks_of_a_latch_are_read_and_keys_without_hooks_are_refused() {
    let hook = "{ point = [\"0 m\", \"0.1 m\", \"0 m\"], seat = [\"0 m\", \"0.1 m\", \"0 m\"] }";
    let with = |lines: &str| FREE_BODY.replace("[part_a]\n", &format!("{LATCH}{lines}\n[part_a]\n"));
    let own = scenario(&with(&format!("hook = [{hook}, {hook}]\nhook_reach = \"4 mm\"\nfailed = 2")));
    let m = own.unwrap_or_else(|problems| panic!("{problems}")).model;
    let latch = m.contact.latch.expect("a latch");
    assert_eq!((latch.hooks.len(), latch.hook_reach, m.nominal.latch_failed), (2, 4e-3, 2.0));
    let cases = [
        ("hook_reach = \"4 mm\"".to_owned(), "the latch has no hooks"),
        ("failed = 0".to_owned(), "the latch has no hooks"),
        (format!("hook = [{hook}]"), "`hook_reach` is missing"),
        (format!("hook = [{hook}]\nhook_reach = \"4 mm\"\nfailed = 2"), "out of range"),
        (format!("hook = [{hook}]\nhook_reach = \"4 mm\"\nfailed = 0.5"), "is no number of a hook"),
    ];
    for (lines, what) in cases {
        let problems = scenario(&with(&lines)).expect_err(what);
        assert!(problems.to_string().contains(what), "{lines}: {problems}");
    }
}

/// A mast that slides along x with a boom that turns about z; on the mast an antenna that turns, on the root another one.
const MAST: &str = r#"<robot name="mast"><link name="root"/>
  <joint name="mast" type="prismatic"><axis xyz="1 0 0"/><parent link="root"/><child link="m"/>
    <limit lower="-0.5" upper="1" effort="200" velocity="0.2"/></joint>
  <link name="m"><inertial><origin xyz="0.1 0 0"/><mass value="10"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="boom" type="revolute"><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/><parent link="m"/><child link="b"/>
    <limit lower="-2" upper="2" effort="50" velocity="1"/></joint>
  <link name="b"><inertial><origin xyz="0.3 0 0"/><mass value="5"/>
    <inertia ixx="0.1" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="dish" type="revolute"><origin xyz="0 0.4 0"/><axis xyz="0 1 0"/><parent link="m"/><child link="d"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <link name="d"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="flap" type="revolute"><origin xyz="-1 0 0"/><axis xyz="0 1 0"/><parent link="root"/><child link="f"/>
    <limit lower="0.1" upper="1" effort="1" velocity="1"/></joint>
  <link name="f"><inertial><mass value="100"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;

const ON_MAST: &str = r#"[arm]
urdf = "mast.urdf"
angles = ["200 mm", "10 deg"]
held = { flap = "0.2 rad", dish = "-30 deg" }
[arm.controller]
law = "joint_pd"
joint_stiffness = ["400 N/m", "50 N m/rad"]
joint_damping = ["200 N s/m", "20 N m s/rad"]
[part_a]
link = "b"
"#;

/// The free body on the mast, with a change of the scenario.
fn on_mast(change: impl Fn(String) -> String) -> Result<Scenario, Problems> {
    let text = change(FREE_BODY.replace("[part_a]\n", ON_MAST));
    let source = Source::new("test.toml".into(), text);
    let file: ScenarioFile = read::parse(&source, FORMAT)?;
    let mut c = Checker::new(source);
    c.known = vec![Source::new(c.source.sibling("mast.urdf"), MAST.to_owned())];
    Scenario::checked(c, file, None)
}

#[test]
fn a_joint_that_slides_has_lengths_and_forces_and_joints_off_the_chain_are_held() {
    let scenario = on_mast(|text| text).unwrap_or_else(|problems| panic!("{problems}"));
    let m = &scenario.model;
    assert_eq!((m.slides.clone(), m.start_angles[0]), (vec![true, false], 0.2));
    let softdock_kernels::model::ArmControl::JointPd { stiffness, damping } = m.guidance.arm else {
        panic!("joint_pd")
    };
    assert_eq!((&stiffness[..2], &damping[..2]), (&[400.0, 50.0][..], &[200.0, 20.0][..]));
    assert_eq!((m.links[0].mass, m.links[1].mass), (12.0, 5.0), "the dish is on the mast");
    // The flap of 100 kg at x = -1 m moves the centre of the base of 400 kg by -0.2 m.
    assert_eq!(m.nominal.base_mass, 500.0);
    assert!((m.base_inertia.yy - (60.0 + 1.0 + 80.0)).abs() < 1e-9 && (m.base_inertia.xx - 61.0).abs() < 1e-9);
    let tool = m.base_pose.compose(crate::placement::end_frame(&m.links, &m.slides, &m.start_angles, m.tool));
    assert!((tool.position - vec3(-0.15, 0.0, 0.0)).norm() < 1e-12, "{:?}", tool.position);
    // At the start the boom's joint is 0.7 m from the root.
    let boom = m.links[0].origin.position.x + 0.7;
    assert!((boom - 0.9).abs() < 1e-12, "{boom}");
    let lines = crate::arm_notes::arm_lines(&scenario);
    assert_eq!(
        lines[..2],
        [
            "joint `flap`: held at 0.2 rad, 100 kg on link `root`".to_owned(),
            "joint `dish`: held at -0.523599 rad, 2 kg on link `m`".to_owned(),
        ]
    );

    let drive = "[arm.drive]\nrotor_inertia = [\"4 kg\", \"2e-3 kg m^2\"]\ngear_ratio = [1, 10]\n\
                 stop_stiffness = [\"5e3 N/m\", \"5e2 N m/rad\"]\n[part_a]";
    let driven = on_mast(|text| text.replace("[part_a]", drive)).unwrap_or_else(|problems| panic!("{problems}"));
    let drives = &driven.model.drives;
    assert_eq!((drives[0].drive.reflected_inertia(), drives[0].drive.torque_limit), (4.0, 200.0));
    let stops = drives[0].stops.expect("limits");
    assert!((stops.lower + 0.7).abs() < 1e-12 && (stops.upper - 0.8).abs() < 1e-12);
    assert!(crate::arm_notes::arm_lines(&driven)[2].contains("rotor 4 kg behind"));
}

#[test]
fn faults_of_held_and_sliding_joints_name_the_key_and_the_remedy() {
    let cases: [(&str, &str, &str, &str); 8] = [
        ("flap = \"0.2 rad\", ", "", "arm.urdf", "held = { flap = "),
        ("\"-30 deg\"", "\"-2 rad\"", "arm.held.dish", "-1 rad to 1 rad"),
        ("dish =", "dich =", "arm.held.dich", "`dish`"),
        ("dish = \"-30 deg\"", "boom = \"0 rad\"", "arm.held.boom", "arm.angles"),
        ("\"200 mm\"", "\"10 deg\"", "arm.angles", "m"),
        ("\"200 mm\"", "\"1.2 m\"", "arm.angles", "to 1.000000 m"),
        ("\"400 N/m\"", "\"400 N m/rad\"", "arm.controller.joint_stiffness", "N/m"),
        ("link = \"b\"\n", "", "joint[", "part_a.link"),
    ];
    for (old, new, key, remedy) in cases {
        let problems = on_mast(|text| text.replace(old, new)).expect_err(new);
        let problem = problems.iter().next().expect("a problem");
        assert!(problem.key.starts_with(key), "{old}: {problem}");
        assert!(problem.remedy.contains(remedy), "{old}: {problem}");
    }
    let base =
        "[base]\nmass = \"400 kg\"\ninertia = { ixx = \"60 kg m^2\", iyy = \"60 kg m^2\", izz = \"60 kg m^2\" }\n";
    let held =
        on_mast(|text| text.replace(base, "[base]\nheld = true\n")).unwrap_or_else(|problems| panic!("{problems}"));
    assert_eq!((held.model.held.base, held.model.links[0].origin.position.x), (true, 0.0));
}
