//! The effect table: at its null value an effect changes no bit, at its scale it changes the facility and never space.

use super::bench::{closing, job, numbered};
use super::lanes::six_joints;
use softdock_engine::Engine;
use softdock_engine::Job;
use softdock_engine::cpu::CpuEngine;
use softdock_kernels::effects::{EFFECTS, Effect, EffectParameter, EffectSet};
use softdock_kernels::fields::{fields, from_slice, to_vec};
use softdock_kernels::manipulator::cell::Feedforward;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::{Model, Rail, SensorLoad};
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::vector::vec3;

/// The same on two robots with joints, their whole model fed forward.
fn jointed() -> Model {
    let mut model = model();
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/scenarios/smoke_joint.toml");
    let shipped = softdock_campaign::load_scenario(&path).expect("a shipped scenario loads").model;
    let mut level = shipped.facility.joint_level.expect("robots with joints");
    level.servo.feedforward = Feedforward::Full;
    model.facility.joint_level = Some(level);
    model
}

/// Whether an effect is one of robots with joints.
fn of_joints(effect: &Effect) -> bool {
    effect.id.starts_with('J')
}

/// Whether a tare takes an effect off.
fn of_tare(effect: &Effect) -> bool {
    effect.id == "S1_bias"
}

fn untared() -> Model {
    let mut model = model();
    model.facility.tared = false;
    model
}

/// An arm that touches a plane with friction on a facility where every effect has something to act on.
fn model() -> Model {
    let mut model = six_joints(2.5e-4, 0.4);
    model.timing.substeps = 4;
    model.timing.max_ticks = 400;
    model.facility.rail = Some(Rail { axis: vec3(1.0, 0.0, 0.0), share: 0.4 });
    model.facility.tared = true;
    model.facility.load = Some(SensorLoad {
        mass: 8.0,
        centre: vec3(0.02, 0.0, 0.05),
        gravity: vec3(0.0, 0.0, -9.81),
        inertia_compensated: true,
    });
    model.facility.crosstalk = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.0 } else { 0.5 }));
    model
}

fn plain() -> Params<f64> {
    Params {
        base_mass: 400.0,
        target_mass: 300.0,
        drift: vec3(0.0, 0.02, 0.01),
        target_rate: vec3(0.0, 0.02, -0.01),
        contact_friction: 0.2,
        loop_delay: model().timing.own_delay(),
        bristle_stiffness: 5e3,
        // Fast enough for every limit at its scale.
        ..closing(1.0, 0.6, 1e4, 30.0)
    }
}

/// The same on robots that follow at once; their drives without friction shapes, gears and lags of any kind.
fn plain_with_joints() -> Params<f64> {
    let mut p = plain();
    for robot in [&mut p.robot1, &mut p.robot2] {
        (robot.position_gain, robot.velocity_feedforward) = (10.0, 1.0);
    }
    p
}

/// The parameters with some fields overwritten.
fn with(base: Params<f64>, parameters: &[EffectParameter], value: impl Fn(&EffectParameter) -> f64) -> Params<f64> {
    let names = fields::<f64, Params<f64>>();
    let mut values = to_vec(&base);
    for parameter in parameters {
        let place = names.iter().position(|field| field.name == parameter.field);
        values[place.unwrap_or_else(|| panic!("no parameter {}", parameter.field))] = value(parameter);
    }
    from_slice(&values)
}

fn made(job: &Job, params: &[Params<f64>]) -> Vec<Finished> {
    CpuEngine::new().run(job, &numbered(params), &|_| true).expect("nobody stops the batch")
}

fn bits(metrics: &Metrics<f64>) -> Vec<u64> {
    to_vec(metrics).iter().map(|v| v.to_bits()).collect()
}

#[test]
fn an_effect_at_its_null_value_changes_no_bit() {
    let timing = model().timing;
    let null = |parameter: &EffectParameter| parameter.null_value(&timing).unwrap_or(parameter.scale);
    let params: Vec<_> =
        std::iter::once(plain()).chain(EFFECTS.iter().map(|effect| with(plain(), effect.parameters, null))).collect();
    let quiet = made(&job(model(), &params), &params);
    // Random numbers that are drawn but weigh nothing change nothing either.
    let noisy = made(
        &Job {
            batch: softdock_kernels::frame::Batch { noisy: true, ..job(model(), &params).batch },
            ..job(model(), &params)
        },
        &params,
    );
    assert!(quiet[0].space.touch_time > 0.0 && quiet[0].hil.touch_time > 0.0);
    for (row, id) in quiet[1..].iter().zip(EFFECTS.iter().map(|effect| effect.id)) {
        assert!(bits(&row.space) == bits(&quiet[0].space) && bits(&row.hil) == bits(&quiet[0].hil), "{id} at null");
    }
    for (row, silent) in noisy.iter().zip(&quiet) {
        assert!(bits(&row.space) == bits(&silent.space), "space, run {}", row.run);
        assert!(bits(&row.hil) == bits(&silent.hil), "facility, run {}\n{:?}\n{:?}", row.run, row.hil, silent.hil);
    }
}

/// Terms of effects that no run has are optional: kernels and lanes without them give the same bits.
#[test]
fn an_effect_that_is_left_out_changes_no_bit() {
    let compared = [(model(), plain()), (jointed(), plain_with_joints())];
    for (model, params) in compared {
        let whole = job(model, &[params]);
        let effects = EffectSet::of(&params, &whole.plant.timing);
        assert_eq!(effects.iter().next(), None, "an effect off its null");
        let bare = Job { plant: whole.plant.clone().with_effects(effects), ..whole.clone() };
        let [with, without] = [whole, bare].map(|job| {
            let row = CpuEngine::new().run(&job, &numbered(&[params]), &|_| true).expect("nobody stops the batch")[0];
            [bits(&row.space), bits(&row.hil)]
        });
        assert!(with == without, "{with:?}\n{without:?}");
    }
}

#[test]
fn an_effect_at_its_scale_changes_the_facility_and_never_space() {
    let others: fn(&Effect) -> bool = |effect| !of_joints(effect) && !of_tare(effect);
    let cases =
        [(model(), plain(), others), (untared(), plain(), of_tare), (jointed(), plain_with_joints(), of_joints)];
    for (model, base, belongs) in cases {
        let effects: Vec<_> = EFFECTS.iter().filter(|effect| belongs(effect)).collect();
        let params: Vec<_> = std::iter::once(base)
            .chain(effects.iter().map(|effect| with(base, effect.parameters, |parameter| parameter.scale)))
            .collect();
        let rows = made(&job(model, &params), &params);
        assert!(rows[0].hil.touch_time > 0.0 && rows[0].hil.peak_contact_force > 0.0, "{:?}", rows[0].hil);
        for (row, effect) in rows[1..].iter().zip(effects) {
            assert!(bits(&row.space) == bits(&rows[0].space), "{} changes space", effect.id);
            assert!(bits(&row.hil) != bits(&rows[0].hil), "{} does nothing", effect.id);
        }
    }
}
