//! Drives together: enabled at their positions, one fault stops all, and no statuswords make a target jump.

use super::super::cia402::control;
use super::*;
use proptest::prelude::*;

const STATUS: [(DriveState, u16); 6] = [
    (DriveState::SwitchOnDisabled, 0x40),
    (DriveState::ReadyToSwitchOn, 0x21),
    (DriveState::SwitchedOn, 0x23),
    (DriveState::OperationEnabled, 0x27),
    (DriveState::QuickStopActive, 0x07),
    (DriveState::Fault, 0x08),
];

/// Obedient drives with a lag behind their targets.
struct Rig {
    drives: Drives,
    reports: [Report; AXES],
    count: usize,
}

impl Rig {
    fn new(count: usize) -> Self {
        let steps = [100; AXES];
        let mut reports = [Report { statusword: 0x40, mode: Some(8), ..Report::default() }; AXES];
        for (i, report) in reports.iter_mut().enumerate() {
            report.position = 1000 * (i as i32 + 1);
        }
        Self { drives: Drives::new(&steps[..count], false), reports, count }
    }

    fn at(&self) -> [i32; AXES] {
        self.reports.map(|report| report.position)
    }

    fn cycle(&mut self, aim: Aim) -> [ServoCommand; AXES] {
        let commands = self.drives.step(&aim, &self.reports);
        for (report, command) in self.reports[..self.count].iter_mut().zip(&commands) {
            report.statusword = match (report.statusword, command.controlword) {
                (0x08, _) => 0x08,
                (0x27 | 0x07, control::QUICK_STOP) => 0x40,
                (_, control::DISABLE_VOLTAGE | control::QUICK_STOP) => 0x40,
                (_, control::SHUTDOWN) => 0x21,
                (0x21 | 0x23, control::SWITCH_ON) => 0x23,
                (0x23 | 0x27, control::ENABLE_OPERATION) => 0x27,
                (same, _) => same,
            };
            if report.statusword == 0x27 {
                report.position += (command.target - report.position) / 2;
            }
        }
        commands
    }

    fn enable(&mut self) {
        let at = self.at();
        for _ in 0..10 {
            self.cycle(Aim::Follow(at));
        }
        assert_eq!(self.drives.phase(), BringUpPhase::Following);
    }
}

#[test]
fn all_drives_are_enabled_together_at_their_positions() {
    let mut rig = Rig::new(7);
    assert!(rig.drives.ready(&rig.reports));
    rig.enable();
    let start = rig.at();
    for i in 1..=50 {
        rig.cycle(Aim::Follow(start.map(|counts| counts + 90 * i)));
        assert_eq!(rig.drives.phase(), BringUpPhase::Following);
    }
    assert!(rig.reports.iter().zip(start).all(|(report, start)| report.position > start + 4000));
    assert!(rig.drives.ready(&rig.reports));
}

#[test]
fn hold_enables_nothing_and_targets_follow_positions() {
    let mut rig = Rig::new(7);
    for i in 0..100 {
        rig.reports[3].position += i;
        let commands = rig.cycle(Aim::Rest);
        assert!(commands.iter().all(|command| command.controlword == control::DISABLE_VOLTAGE));
        assert_eq!(commands[3].target, rig.reports[3].position);
    }
}

#[test]
fn hold_after_motion_is_a_quick_stop_that_permits_enabling() {
    let mut rig = Rig::new(7);
    rig.enable();
    let before = rig.drives.targets();
    let commands = rig.cycle(Aim::Rest);
    assert!(commands.iter().all(|command| command.controlword == control::QUICK_STOP));
    assert_eq!(commands.map(|command| command.target), before);
    let commands = rig.cycle(Aim::Rest);
    assert!(commands.iter().all(|command| command.controlword == control::DISABLE_VOLTAGE));
    assert!(rig.drives.ready(&rig.reports));
    rig.enable();
}

#[test]
fn one_fault_stops_all_drives() {
    let mut rig = Rig::new(7);
    rig.enable();
    rig.reports[2].statusword = 0x08;
    let at = rig.at();
    let commands = rig.cycle(Aim::Follow(at));
    assert_eq!(rig.drives.phase(), BringUpPhase::Tripped(Trip::Drive(2)));
    assert!((0..7).filter(|i| *i != 2).all(|i| commands[i].controlword == control::QUICK_STOP));
    assert!(!rig.drives.ready(&rig.reports));
    rig.reports[2].statusword = 0x40;
    for _ in 0..100 {
        assert!(rig.cycle(Aim::Follow(at)).iter().all(|command| command.controlword & 0x0F != 0x0F));
    }
}

#[test]
fn far_target_is_not_sent_and_stops_the_drives() {
    let mut rig = Rig::new(3);
    rig.enable();
    let mut far = rig.at();
    far[1] += 101;
    assert_eq!(rig.drives.jump(&far), Some(1));
    let before = rig.drives.targets();
    let commands = rig.cycle(Aim::Follow(far));
    assert_eq!(rig.drives.phase(), BringUpPhase::Tripped(Trip::Jump(1)));
    assert_eq!(commands.map(|command| command.target), before);
    assert!(commands[..3].iter().all(|command| command.controlword == control::QUICK_STOP));
}

#[test]
fn end_reaches_standstill_before_the_quick_stop() {
    let mut rig = Rig::new(7);
    rig.enable();
    let end = rig.at().map(|counts| counts + 80);
    let mut enabled = 0;
    while rig.drives.phase() != BringUpPhase::Ended {
        let commands = rig.cycle(Aim::Finish(end));
        enabled += u32::from(commands[0].controlword == control::ENABLE_OPERATION);
        assert!(enabled < 100);
    }
    assert!(enabled >= STANDING_CYCLES, "{enabled}");
    rig.cycle(Aim::Finish(end));
    assert!(rig.drives.off(&rig.reports));
    assert!(!rig.drives.ready(&rig.reports));
}

#[test]
fn drive_that_is_not_enabled_in_time_is_named() {
    let mut rig = Rig::new(2);
    let at = rig.at();
    for _ in 0..=ENABLING_CYCLES + 1 {
        rig.cycle(Aim::Follow(at));
        rig.reports[1].statusword = 0x40;
    }
    assert_eq!(rig.drives.phase(), BringUpPhase::Tripped(Trip::NotEnabled(1)));
}

#[test]
fn torque_needs_the_right_mode() {
    let mut rig = Rig::new(1);
    rig.reports[0].mode = Some(1);
    let at = rig.at();
    assert!((0..50).all(|_| rig.cycle(Aim::Follow(at))[0].controlword == control::DISABLE_VOLTAGE));
    rig.reports[0].mode = Some(8);
    rig.enable();
    rig.reports[0].mode = Some(1);
    rig.cycle(Aim::Follow(at));
    assert_eq!(rig.drives.phase(), BringUpPhase::Tripped(Trip::Mode(0)));
}

fn arbitrary_report() -> impl Strategy<Value = Report> {
    let word = prop_oneof![
        6 => (0..STATUS.len()).prop_map(|i| STATUS[i].1),
        1 => any::<u16>(),
    ];
    let mode = prop_oneof![6 => Just(Some(8i8)), 1 => any::<Option<i8>>()];
    (word, -2000..2000i32, mode).prop_map(|(statusword, position, mode)| Report {
        statusword,
        position,
        mode,
        ..Report::default()
    })
}

fn arbitrary_aim() -> impl Strategy<Value = Aim> {
    let targets = prop::array::uniform7(-2000..2000i32);
    prop_oneof![
        1 => Just(Aim::Rest),
        6 => targets.clone().prop_map(Aim::Follow),
        1 => targets.prop_map(Aim::Finish),
    ]
}

/// Cycles with obedient drives, so that following is reached, and arbitrary cycles between.
fn mixed() -> impl Strategy<Value = Vec<Option<(Aim, [Report; 2])>>> {
    let wild = (arbitrary_aim(), [arbitrary_report(), arbitrary_report()]).prop_map(Some);
    prop::collection::vec(prop_oneof![4 => Just(None), 1 => wild], 1..120)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn targets_never_jump_while_enabled(cycles in mixed()) {
        let mut rig = Rig::new(2);
        let mut before: Option<[ServoCommand; AXES]> = None;
        for cycle in cycles {
            let aim = match cycle {
                Some((aim, reports)) => {
                    rig.reports[..2].copy_from_slice(&reports);
                    aim
                }
                None => Aim::Follow(rig.drives.targets()),
            };
            let positions = rig.at();
            let commands = rig.cycle(aim);
            for i in 0..2 {
                let enabled = |command: &ServoCommand| command.controlword == control::ENABLE_OPERATION;
                if enabled(&commands[i]) {
                    match before.filter(|before| enabled(&before[i])) {
                        Some(before) => prop_assert!(commands[i].target.abs_diff(before[i].target) <= 100),
                        None => prop_assert_eq!(commands[i].target, positions[i], "first target is not the present position"),
                    }
                }
            }
            before = Some(commands);
        }
    }
}
