//! Scenarios compiled from texts, against values worked by hand.

use super::*;
use softdock_kernels::model::{NormalLaw, Shape};
use softdock_kernels::vector::vec3;

/// A ball of 400 kg against a plane on a target of 400 kg.
pub(crate) const FREE_BODY: &str = r#"
schema = "scenario/1"
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
[task]
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
    assert_eq!(m.contact.solids[0].shape, Shape::Plane);
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
    let problem = first("[task]", "[facility]\nloop_delay = \"0.2 ms\"\nsensor = { delay = \"1 ms\" }\n[task]");
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
