//! All drives of a robot: enabled together at their positions, led by targets, stopped together.

use super::cia402::{DriveState, Sequence, Wish, mode};
use super::mapping::{Report, ServoCommand};
use crate::signals::AXES;

/// Cycles after which an incomplete enabling has failed.
pub const ENABLING_CYCLES: u32 = 5000;
/// Cycles of standstill before the quick stop that ends a session.
const STANDING_CYCLES: u32 = 20;
/// Cycles after which a session ends even if an axis does not come to a standstill.
const FINISH_CYCLES: u32 = 2000;
/// Share of an axis' greatest step per cycle below which it counts as standing.
const STANDING_SHARE: i32 = 500;

/// Command to the drives for a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Aim {
    /// Off, targets at the axis positions.
    #[default]
    Rest,
    /// Enabled, at these targets \[counts\].
    Follow([i32; AXES]),
    /// To these targets \[counts\]; at standstill, a quick stop and off.
    Finish([i32; AXES]),
}

/// Reason why the drives have tripped or were switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trip {
    /// A drive has left *operation enabled*; its number among the axes in use.
    Drive(usize),
    /// A drive has left cyclic synchronous position; its number.
    Mode(usize),
    /// Not all drives were enabled in time; the first that was not.
    NotEnabled(usize),
    /// A target exceeded the greatest step per cycle; its drive.
    Jump(usize),
}

impl Trip {
    /// Returns the reason as text.
    pub fn text(self) -> &'static str {
        match self {
            Self::Drive(_) => "a drive has left operation enabled",
            Self::Mode(_) => "a drive has left cyclic synchronous position",
            Self::NotEnabled(_) => "a drive was not enabled in time",
            Self::Jump(_) => "a target exceeded the greatest step of its axis per cycle",
        }
    }
}

/// Phase of all drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BringUpPhase {
    /// Off.
    Resting,
    /// Enabling, for this number of cycles.
    Enabling(u32),
    /// All follow their targets.
    Following,
    /// All follow their last targets to a standstill: cycles so far, cycles of standstill.
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
    /// Position in the previous report \[counts\].
    last: i32,
    /// Whether it has or may have torque by our enabling: its target is then kept.
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
    /// Creates drives that are off. `steps` are the greatest steps between two targets \[counts\], one for each drive;
    /// surplus ones beyond [`AXES`] are ignored. With `reset`, faults before the first enabling are acknowledged once.
    pub fn new(steps: &[i32], reset: bool) -> Self {
        let mut drives = [Drive::default(); AXES];
        for (drive, step) in drives.iter_mut().zip(steps) {
            *drive = Drive { sequence: Sequence::new(reset), step: (*step).max(1), ..Drive::default() };
        }
        Self { drives, count: steps.len().min(AXES), phase: BringUpPhase::Resting }
    }

    /// Returns the phase.
    pub fn phase(&self) -> BringUpPhase {
        self.phase
    }

    /// Returns the last commanded targets \[counts\].
    pub fn targets(&self) -> [i32; AXES] {
        self.drives.map(|drive| drive.target)
    }

    /// Whether they follow, or can be enabled.
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

    /// Whether no drive reports torque on.
    pub fn off(&self, reports: &[Report; AXES]) -> bool {
        reports[..self.count].iter().all(|report| {
            let state = DriveState::of(report.statusword);
            !matches!(state, DriveState::OperationEnabled | DriveState::QuickStopActive | DriveState::FaultReaction)
        })
    }

    /// Returns the first drive whose target exceeds its greatest step; only while they follow.
    pub fn jump(&self, targets: &[i32; AXES]) -> Option<usize> {
        matches!(self.phase, BringUpPhase::Following | BringUpPhase::Finishing(..))
            .then(|| self.farthest(targets))
            .flatten()
    }

    fn farthest(&self, targets: &[i32; AXES]) -> Option<usize> {
        let mut drives = self.drives[..self.count].iter().zip(targets);
        drives.position(|(drive, target)| target.abs_diff(drive.target) > drive.step.unsigned_abs())
    }

    /// Returns the commands of a cycle from the request and the drives' reports.
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
                let still = if self.is_standing(targets, reports) { still + 1 } else { 0 };
                if still >= STANDING_CYCLES || cycles >= FINISH_CYCLES {
                    BringUpPhase::Ended
                } else {
                    BringUpPhase::Finishing(cycles + 1, still)
                }
            }
        }
    }

    fn is_standing(&self, targets: &[i32; AXES], reports: &[Report; AXES]) -> bool {
        self.drives[..self.count].iter().zip(targets).zip(reports).all(|((drive, target), report)| {
            // Two counts are the noise of an encoder at rest.
            let still = (drive.step / STANDING_SHARE).max(2).unsigned_abs();
            drive.target == *target && report.position.abs_diff(drive.last) <= still
        })
    }

    /// Steps every sequence; the target of a drive that cannot follow yet is its position.
    fn sequence(&mut self, wish: Wish, reports: &[Report; AXES]) -> [ServoCommand; AXES] {
        let mut commands = [ServoCommand::default(); AXES];
        for ((drive, report), command) in self.drives[..self.count].iter_mut().zip(reports).zip(&mut commands) {
            let was_enabling = drive.sequence.enabling();
            // Enables torque only once the displayed mode is the right one.
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

    /// Evaluates the drives after their sequences: all on, one lost, or timed out.
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

    /// Sets new targets of following drives, or ends the following if one is too far away.
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
