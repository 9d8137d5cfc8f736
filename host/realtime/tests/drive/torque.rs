//! Torques compared with the measured force: expected values, and a force on a robot outside the sensor.

use crate::fixture::{Setting, bias};
use softdock_kernels::philox::{self, uniform};
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::{Vec3, vec3};
use softdock_realtime::arms::Arms;
use softdock_realtime::clock::Virtual;
use softdock_realtime::drive::checklist::CheckKind;
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::in_process::{InProcessRig, links};
use softdock_realtime::emulation::world::World;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::signals::Links;
use softdock_realtime::signals::{AXES, Capabilities, LinkCounters, LinkFault, Order, RobotLink, RobotState};
use softdock_realtime::time::Nanos;
use std::cell::RefCell;
use std::rc::Rc;

/// Limits of the joints \[N m\].
const LIMITS: [f64; 6] = [300.0, 300.0, 200.0, 60.0, 60.0, 60.0];

/// A robot that also reports torques: from its weight, the true contact, and a disturbance.
struct WithTorques {
    inner: Box<dyn RobotLink>,
    robot: usize,
    arms: Arms,
    bench: Rc<RefCell<InProcessRig>>,
    added: Rc<RefCell<[f64; AXES]>>,
}

impl RobotLink for WithTorques {
    fn capabilities(&self) -> Capabilities {
        self.inner.capabilities()
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        let report = self.inner.receive(deadline)?;
        Ok(report.map(|mut report| {
            let contact = contact(self.bench.borrow().world(), self.robot);
            let torques = self.arms.torques(self.robot, &report.position, contact);
            let mut all = *self.added.borrow();
            all.iter_mut().zip(torques).for_each(|(all, torque)| *all += torque);
            report.torque = Some(all);
            report
        }))
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        self.inner.send(order)
    }

    fn counters(&self) -> LinkCounters {
        self.inner.counters()
    }
}

/// Returns the contact wrench on a robot's part about its origin, laboratory axes.
fn contact(world: &World, robot: usize) -> Wrench<f64> {
    let (parts, wrench) = (world.parts(), world.wrench());
    let (force, moment) = (parts.a.attitude.rotate(wrench.force), parts.a.attitude.rotate(wrench.moment));
    if robot == 0 {
        return Wrench { force, moment };
    }
    let about_b = moment + (parts.a.position - parts.b.position).cross(force);
    Wrench { force: force * -1.0, moment: about_b * -1.0 }
}

/// A session in process whose robots report torques, with a disturbance of robot 2's torques.
fn session(setting: &Setting) -> (Session, Rc<RefCell<[f64; AXES]>>) {
    let clock = Virtual::default();
    let world =
        World::new(&setting.plant, &setting.station, philox::key(setting.seed), setting.run, &setting.params, bias());
    let bench = InProcessRig::new(world.expect("in reach"), Rc::new(clock.clone()), Nanos::from_millis(1));
    let added = Rc::new(RefCell::new([0.0; AXES]));
    let Links { robots, sensor } = links(&bench);
    let mut robot = 0;
    let robots = robots.map(|inner| {
        let arms = Arms::new(&setting.plant, &setting.station).expect("in reach");
        // The drives of robot 1 add their friction, constant here: the tare removes it.
        let added = if robot == 1 { Rc::clone(&added) } else { Rc::new(RefCell::new([25.0; AXES])) };
        let with = WithTorques { inner, robot, arms, bench: Rc::clone(&bench), added };
        robot += 1;
        Box::new(with) as Box<dyn RobotLink>
    });
    let session = Session::new(setting.task(), Links { robots, sensor }, None, Rc::new(clock)).expect("prepared");
    (session, added)
}

fn setting() -> Setting {
    let mut setting = Setting { armed: false, ..Setting::docking() };
    setting.station.torques.limits = Some(LIMITS);
    setting
}

#[test]
fn torques_of_measured_contact_do_not_stop_the_run() {
    let (mut session, _) = session(&setting());
    while !session.cycle(None) {}
    assert_eq!(session.record().cause, StopCause::Completed, "{:?}", session.core().stopped());
    let worst = session.core().worst_torques();
    assert!(worst.iter().all(|share| *share > 0.0 && *share < 0.5), "{worst:?}");
}

#[test]
fn unexplained_torque_stops_the_session() {
    let (mut session, added) = session(&setting());
    while session.record().tick < 500 {
        assert!(!session.cycle(None), "{:?}", session.core().refusal());
    }
    // A force on the forearm of robot 2.
    added.borrow_mut()[2] = 250.0;
    let from = session.record().time;
    while !session.cycle(None) {}
    let (at, alarm) = session.core().stopped().expect("a stop");
    assert_eq!(alarm.cause, StopCause::Torque);
    let found = alarm.violation.expect("robot, axis, value and limit");
    assert_eq!((found.robot, found.axis, found.limit, found.unit), (Some(1), Some(2), 200.0, "N m"));
    assert!((found.value - 250.0).abs() < 20.0, "{found:?}");
    let within = (at - from).seconds();
    assert!((0.05..0.055).contains(&within), "{within} s: the delay in the facility file");
}

#[test]
fn torque_limits_need_a_robot_that_reports_torques() {
    let setting = setting();
    let world = setting.world();
    let clock = Virtual::default();
    let bench = InProcessRig::new(world, Rc::new(clock.clone()), Nanos::from_millis(1));
    let mut session = Session::new(setting.task(), links(&bench), None, Rc::new(clock)).expect("prepared");
    while !session.cycle(None) {}
    let refusal = session.core().refusal().expect("a refusal");
    assert_eq!((refusal.kind, refusal.robot), (CheckKind::Torques, Some(0)), "{refusal}");
}

#[test]
fn torques_of_a_wrench_match_its_virtual_work() {
    let setting = Setting::docking();
    let arms = Arms::new(&setting.plant, &setting.station).expect("in reach");
    let (home, _) = arms.positions_for(&setting.plant.start);
    let draw = |n: u32, k: u32| uniform(7, "torques", u64::from(n), k) * 2.0 - 1.0;
    for n in 0..200 {
        let robot = (n % 2) as usize;
        let position: [f64; AXES] = std::array::from_fn(|i| home[robot][i] + 0.3 * draw(n, i as u32));
        let vector = |k: u32| vec3(draw(n, k), draw(n, k + 1), draw(n, k + 2));
        let wrench = Wrench { force: vector(10) * 500.0, moment: vector(20) * 50.0 };
        let [with, without] = [wrench, Wrench::zero()].map(|wrench| arms.torques(robot, &position, wrench));
        for i in 0..6 {
            // Translation and rotation of the part for a small rotation of one joint, by differences of its poses.
            let step = 1e-6;
            let part = |by: f64| {
                let mut moved = position;
                moved[i] += by;
                arms.part_on(robot, &moved, &[0.0; AXES])
            };
            let (before, after) = (part(-step), part(step));
            let turn = after.attitude.compose(before.attitude.conjugate());
            let work = wrench.force.dot(after.position - before.position) + wrench.moment.dot(turn.v * 2.0);
            let expected = -work / (2.0 * step);
            let found = with[i] - without[i];
            assert!((found - expected).abs() < 1e-4 * (1.0 + expected.abs()), "joint {i}: {found} {expected}");
        }
        // At rest axis 1 is vertical: weight causes no torque on it.
        assert!(without[0].abs() < 1e-6, "{without:?}");
    }
    let still: Vec3<f64> = Vec3::zero();
    assert_eq!(
        arms.torques(0, &home[0], Wrench { force: still, moment: still }),
        arms.torques(0, &home[0], Wrench::zero())
    );
}
