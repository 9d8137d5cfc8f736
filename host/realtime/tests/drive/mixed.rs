//! A robot with a cycle of 1 ms under a master with one of 4 ms moves smoothly.

use crate::fixture::{CYCLE, QUANTUM, Rig, SHORT_CYCLE, Setting, greatest_share};
use softdock_realtime::emulation::facility::SetPoint;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::signals::AXES;

/// Accelerations of one axis between its set-points \[rad/s^2\], \[m/s^2\].
fn accelerations(seen: &[SetPoint], axis: usize, cycle: f64) -> Vec<f64> {
    let change = |three: &[SetPoint; 3]| three[2].axes[axis] - 2.0 * three[1].axes[axis] + three[0].axes[axis];
    seen.array_windows::<3>().map(|three| change(three) / (cycle * cycle)).collect()
}

/// Number of sign changes of an axis' acceleration between cycles, beyond rounding on the wire.
fn reversals(seen: &[SetPoint], axis: usize, cycle: f64) -> usize {
    let noise = 8.0 * QUANTUM / (cycle * cycle);
    let accelerations = accelerations(seen, axis, cycle);
    let turns = |two: &[f64; 2]| two[0] * two[1] < 0.0 && two[0].abs().min(two[1].abs()) > noise;
    accelerations.array_windows::<2>().filter(|two| turns(two)).count()
}

#[test]
fn robot_of_1_ms_under_a_master_of_4_ms_moves_smoothly() {
    let setting = Setting::docking();
    let mut rig = Rig::mixed(&setting);
    let last = *rig.finish();
    assert_eq!(last.cause, StopCause::Completed, "{:?}", rig.session.core().refusal());
    assert_eq!((last.robot_1.late_answers, last.robot_2.late_answers), (0, 0));
    let mut network = rig.network.borrow_mut();
    let limits = setting.station.limits;
    for (robot, cycle) in [(0, CYCLE), (1, SHORT_CYCLE)] {
        let seen = network.facility().set_points(robot);
        let share = greatest_share(seen, false, &limits);
        let turns: Vec<usize> = (0..AXES).map(|axis| reversals(seen, axis, cycle.seconds())).collect();
        println!("robot {}: {} cycles, {share:.3} of a limit, reversals {turns:?}", robot + 1, seen.len());
        assert!(share <= 1.05, "robot {}: {share} of a limit", robot + 1);
        // The master's own path turns with the noise of the measured force, by less than that of the wire at 1 ms. A
        // stop from an accelerating motion is one turn; a staircase has hundreds.
        assert!(robot == 0 || turns.iter().all(|turns| *turns <= 2), "robot {}: {turns:?}", robot + 1);
    }
}
