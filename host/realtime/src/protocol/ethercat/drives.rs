//! All drives of a robot together: enabled together from where they stand, led by targets, stopped together.

use super::cia402::{DriveState, Sequence, Wish, mode};
use super::mapping::{Report, ServoCommand};
use crate::signals::AXES;

/// Cycles after which an enabling that has not come to its end has failed.
pub const ENABLING_CYCLES: u32 = 5000;
/// Cycles of standing before the quick stop that ends a session.
const STANDING_CYCLES: u32 = 20;
/// Cycles after which a session ends even if an axis does not come to a stand.
const FINISH_CYCLES: u32 = 2000;
/// An axis stands if it moves by no more than this share of its largest step in a cycle.
const STANDING_SHARE: i32 = 500;

/// What is asked of the drives for a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Aim {
    /// Off, targets where the axes are.
    #[default]
    Rest,
    /// Enabled, at these targets \[counts\].
    Follow([i32; AXES]),
    /// To these targets \[counts\]; when they stand, a quick stop and off.
    Finish([i32; AXES]),
}

/// Why the drives have gone off by themselves, or were taken off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trip {
    /// A drive has left *operation enabled*; its number among the axes in use.
    Drive(usize),
    /// A drive has left cyclic synchronous position; its number.
    Mode(usize),
    /// Not all drives were enabled in time; the first that was not.
    NotEnabled(usize),
    /// A target was farther from the last one than the axis may go in a cycle; its drive.
    Jump(usize),
}

impl Trip {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Drive(_) => "a drive has left operation enabled",
            Self::Mode(_) => "a drive has left cyclic synchronous position",
            Self::NotEnabled(_) => "a drive was not enabled in time",
            Self::Jump(_) => "a target was farther away than an axis may go in a cycle",
        }
    }
}

/// Where the drives stand as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BringUpPhase {
    /// Off.
    Resting,
    /// On the way to operation enabled, for so many cycles.
    Enabling(u32),
    /// All follow their targets.
    Following,
    /// All follow their last targets, to come to a stand: cycles so far, cycles of standing.
    Finishing(u32, u32),
    /// Off by a controlled end; they stay off.
    Ended,
    /// Off by a fault; they stay off.
    Tripped(Trip),
}

/// One of the drives.
#[derive(Clone, Copy, Debug, Default)]
struct Drive {
    sequence: Sequence,
    target: i32,
    /// Largest step between two targets \[counts\].
    step: i32,
    /// Position one report ago \[counts\].
    last: i32,
    /// It has or may have torque by our enabling: its target stays what it was told.
    held: bool,
}

/// The drives of a robot, up to one for each axis.
#[derive(Clone, Copy, Debug)]
pub struct Drives {
    drives: [Drive; AXES],
    count: usize,
    phase: BringUpPhase,
}

impl Drives {
    /// Drives that are off. `steps` are the largest steps between two targets \[counts\], one for each drive; the rest
    /// of them beyond [`AXES`] is ignored. With `reset`, faults found before the first enabling are acknowledged once.
    pub fn new(steps: &[i32], reset: bool) -> Self {
        let mut drives = [Drive::default(); AXES];
        for (drive, step) in drives.iter_mut().zip(steps) {
            *drive = Drive { sequence: Sequence::new(reset), step: (*step).max(1), ..Drive::default() };
        }
        Self { drives, count: steps.len().min(AXES), phase: BringUpPhase::Resting }
    }

    /// Where they stand.
    pub fn phase(&self) -> BringUpPhase {
        self.phase
    }

    /// Targets last commanded \[counts\].
    pub fn targets(&self) -> [i32; AXES] {
        self.drives.map(|drive| drive.target)
    }

    /// They follow, or nothing keeps them from being enabled.
    pub fn ready(&self, reports: &[Report; AXES]) -> bool {
        match self.phase {
            BringUpPhase::Following | BringUpPhase::Finishing(..) => {
                self.drives[..self.count].iter().all(|drive| drive.sequence.on())
            }
            BringUpPhase::Resting | BringUpPhase::Enabling(_) => {
                reports[..self.count].iter().all(|report| DriveState::of(report.statusword).sound())
            }
            BringUpPhase::Ended | BringUpPhase::Tripped(_) => false,
        }
    }

    /// No drive has torque on, by its own report.
    pub fn off(&self, reports: &[Report; AXES]) -> bool {
        reports[..self.count].iter().all(|report| {
            let state = DriveState::of(report.statusword);
            !matches!(state, DriveState::OperationEnabled | DriveState::QuickStopActive | DriveState::FaultReaction)
        })
    }

    /// The first drive whose target is farther from the last one than it may go in a cycle; only while they follow.
    pub fn jump(&self, targets: &[i32; AXES]) -> Option<usize> {
        matches!(self.phase, BringUpPhase::Following | BringUpPhase::Finishing(..))
            .then(|| self.farthest(targets))
            .flatten()
    }

    fn farthest(&self, targets: &[i32; AXES]) -> Option<usize> {
        let mut drives = self.drives[..self.count].iter().zip(targets);
        drives.position(|(drive, target)| target.abs_diff(drive.target) > drive.step.unsigned_abs())
    }

    /// The commands of a cycle, from what is asked and what the drives have reported.
    pub fn step(&mut self, aim: &Aim, reports: &[Report; AXES]) -> [ServoCommand; AXES] {
        self.phase = self.next_phase(aim, reports);
        let wish = match self.phase {
            BringUpPhase::Enabling(_) | BringUpPhase::Following | BringUpPhase::Finishing(..) => Wish::On,
            BringUpPhase::Resting | BringUpPhase::Ended | BringUpPhase::Tripped(_) => Wish::Off,
        };
        let mut commands = self.sequence(wish, reports);
        if wish == Wish::On {
            self.judge(reports);
            self.lead(aim);
            if matches!(self.phase, BringUpPhase::Tripped(_)) {
                commands = self.sequence(Wish::Off, reports);
            }
        }
        for (drive, command) in self.drives.iter().zip(&mut commands) {
            command.target = drive.target;
        }
        commands
    }

    fn next_phase(&self, aim: &Aim, reports: &[Report; AXES]) -> BringUpPhase {
        match (self.phase, aim) {
            (BringUpPhase::Ended | BringUpPhase::Tripped(_), _) => self.phase,
            (_, Aim::Rest) => BringUpPhase::Resting,
            (BringUpPhase::Resting, Aim::Follow(_)) => BringUpPhase::Enabling(0),
            (BringUpPhase::Enabling(cycles), Aim::Follow(_)) => BringUpPhase::Enabling(cycles + 1),
            (BringUpPhase::Following | BringUpPhase::Finishing(..), Aim::Follow(_)) => BringUpPhase::Following,
            (BringUpPhase::Resting | BringUpPhase::Enabling(_), Aim::Finish(_)) => BringUpPhase::Ended,
            (BringUpPhase::Following, Aim::Finish(_)) => BringUpPhase::Finishing(0, 0),
            (BringUpPhase::Finishing(cycles, still), Aim::Finish(targets)) => {
                let still = if self.stands(targets, reports) { still + 1 } else { 0 };
                if still >= STANDING_CYCLES || cycles >= FINISH_CYCLES {
                    BringUpPhase::Ended
                } else {
                    BringUpPhase::Finishing(cycles + 1, still)
                }
            }
        }
    }

    fn stands(&self, targets: &[i32; AXES], reports: &[Report; AXES]) -> bool {
        self.drives[..self.count].iter().zip(targets).zip(reports).all(|((drive, target), report)| {
            // Two counts are the noise of an encoder at rest.
            let still = (drive.step / STANDING_SHARE).max(2).unsigned_abs();
            drive.target == *target && report.position.abs_diff(drive.last) <= still
        })
    }

    /// Steps every sequence; a drive that cannot follow yet has its target where it stands.
    fn sequence(&mut self, wish: Wish, reports: &[Report; AXES]) -> [ServoCommand; AXES] {
        let mut commands = [ServoCommand::default(); AXES];
        for ((drive, report), command) in self.drives[..self.count].iter_mut().zip(reports).zip(&mut commands) {
            let was_enabling = drive.sequence.enabling();
            // Torque comes on in the mode that is displayed: not before it is the right one.
            let wish = if !was_enabling && other_mode(report) { Wish::Off } else { wish };
            command.controlword = drive.sequence.step(wish, report.statusword);
            let torque =
                matches!(DriveState::of(report.statusword), DriveState::OperationEnabled | DriveState::QuickStopActive);
            drive.held = was_enabling || drive.held && torque;
            if !drive.held {
                drive.target = report.position;
            }
            drive.last = report.position;
        }
        commands
    }

    /// Looks at the drives after their sequences: all on, one lost, or too late.
    fn judge(&mut self, reports: &[Report; AXES]) {
        let drives = &self.drives[..self.count];
        let lost = drives.iter().position(|drive| drive.sequence.tripped());
        let elsewhere =
            drives.iter().zip(reports).position(|(drive, report)| drive.sequence.on() && other_mode(report));
        self.phase = match (lost, elsewhere, drives.iter().position(|drive| !drive.sequence.on()), self.phase) {
            (Some(drive), ..) => BringUpPhase::Tripped(Trip::Drive(drive)),
            (_, Some(drive), ..) => BringUpPhase::Tripped(Trip::Mode(drive)),
            (_, _, Some(drive), BringUpPhase::Enabling(ENABLING_CYCLES..)) => {
                BringUpPhase::Tripped(Trip::NotEnabled(drive))
            }
            (_, _, None, BringUpPhase::Enabling(_)) => BringUpPhase::Following,
            (.., phase) => phase,
        };
    }

    /// New targets for drives that follow, or the end of following where one is too far away.
    fn lead(&mut self, aim: &Aim) {
        let (BringUpPhase::Following | BringUpPhase::Finishing(..), Aim::Follow(targets) | Aim::Finish(targets)) =
            (self.phase, aim)
        else {
            return;
        };
        if let Some(drive) = self.farthest(targets) {
            self.phase = BringUpPhase::Tripped(Trip::Jump(drive));
            return;
        }
        for (drive, target) in self.drives[..self.count].iter_mut().zip(targets) {
            drive.target = *target;
        }
    }
}

fn other_mode(report: &Report) -> bool {
    report.mode.is_some_and(|shown| shown != mode::CSP)
}

#[cfg(test)]
#[path = "drives_tests.rs"]
mod tests;
