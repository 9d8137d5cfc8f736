//! A session of emulated robots in virtual time: the same loop as the farm's.

use crate::fixture::{Setting, bias, campaign, farm_run, station};
use softdock_campaign::criteria::succeeds;
use softdock_kernels::frame::single::{TouchThreshold, emulated_facility, simulation_computer};
use softdock_kernels::model::SessionRules;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::{by_differences, commands_poses, extrapolate};
use softdock_realtime::clock::Virtual;
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::in_process::{InProcessRig, links};
use softdock_realtime::emulation::world::World;
use softdock_realtime::log::codes::{Phase, StopCause};
use softdock_realtime::time::Nanos;
use std::rc::Rc;
use std::sync::Arc;

#[test]
fn computer_and_facility_reproduce_the_farm_bit_for_bit() {
    for (file, runs) in [("smoke.toml", 0..6), ("smoke_joint.toml", 0..2), ("probe_drogue.toml", 0..3)] {
        let campaign = campaign(file);
        // The computer alone has no stop rules.
        let mut model = campaign.scenario.model.clone();
        model.facility.rules = SessionRules::NONE;
        if let Some(robots) = &mut model.facility.session_robots {
            robots.limits.iter_mut().for_each(|limit| (limit.lower, limit.upper) = (-1e9, 1e9));
            robots.correction = [1e9; 2];
        }
        let plant = Arc::new(Plant::new(model));
        for run in runs {
            let params = campaign.draw(run).expect("a draw").params;
            let farm = farm_run(&plant, campaign.seed, run, params);
            let mut computer =
                simulation_computer(&plant, run, &params, TouchThreshold { touch_force: 1e-9, hold_back: 0 });
            let mut facility = emulated_facility(&plant, philox::key(campaign.seed), run, &params);
            let first = computer.reference();
            let mut past = [1.0, 2.0].map(|ago| extrapolate(&plant, &first, -ago));
            while !computer.progress().over && facility.watch().end_time == 0.0 {
                let mut reference = computer.reference();
                if commands_poses(&plant) {
                    reference = by_differences(&plant, &past[1], &past[0], &reference);
                }
                past = [reference, past[0]];
                let measured = facility.tick(&reference);
                computer.tick(&measured);
            }
            let watch = facility.watch();
            assert_eq!(
                watch.contact_force.value().to_bits(),
                farm.hil.peak_contact_force.to_bits(),
                "{file} run {run}: peak force"
            );
            assert_eq!(watch.capture_time.to_bits(), farm.hil.capture_time.to_bits(), "{file} run {run}: capture");
            let end = computer.metrics();
            assert_eq!(
                end.linear_momentum_error.to_bits(),
                farm.hil.linear_momentum_error.to_bits(),
                "{file} run {run}"
            );
        }
    }
}

#[test]
fn session_in_virtual_time_agrees_with_the_farm() {
    let Setting { seed, plant, run, params, .. } = Setting::docking();
    let station = Arc::new(station());
    let farm = farm_run(&plant, seed, run, params);
    let clock = Rc::new(Virtual::default());
    let world = World::new(&plant, &station, philox::key(seed), run, &params, bias()).expect("in reach");
    let bench = InProcessRig::new(world, clock.clone(), Nanos::from_millis(1));
    let task = SessionTask::new(Arc::clone(&plant), station, run, params);
    let mut session = Session::new(task, links(&bench), None, clock).expect("prepared");
    let mut phases = Vec::new();
    while !session.cycle(None) {
        let record = session.record();
        if phases.last() != Some(&record.phase) {
            phases.push(record.phase);
        }
        assert!(!record.robot_1.limits.any() && !record.robot_2.limits.any(), "{:?}", record.time);
    }
    assert_eq!(session.record().cause, StopCause::Completed);
    assert_eq!(phases.first(), Some(&Phase::StartUp));
    assert!(phases.contains(&Phase::Contact), "{phases:?}");
    assert!(phases.ends_with(&[Phase::Stopping, Phase::Stopped]), "{phases:?}");
    // The farm's robots begin in motion, these from rest: the start transient is the difference.
    let metrics = session.core().metrics();
    assert_eq!(farm.stop, None);
    assert!(succeeds(&plant.task, &metrics) && succeeds(&plant.task, &farm.hil));
    assert!((metrics.touch_time - farm.hil.touch_time).abs() < 0.1, "{}", metrics.touch_time);
    assert!((metrics.capture_time - farm.hil.capture_time).abs() < 0.2, "{}", metrics.capture_time);
    assert!(metrics.injected_energy < 0.5, "{}", metrics.injected_energy);
}
