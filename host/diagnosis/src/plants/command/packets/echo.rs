//! Rows of a command's recordings without a packet.

use crate::data::grid::Piece;
use crate::plants::command::packets::lag_and_limit::Behind;
use softdock_campaign::rig::CommandRig;

/// Quanta by which a command must move from row to row for a packet to be missed.
const MOVED: f64 = 30.0;
/// Standard deviations of the rounding behind which a lag was taken off, times the root of twelve, that two commands may
/// differ by and be the same.
const FAR: f64 = 4.0;
/// Share of packets that the next row follows with another one, below which packets are held and not lost.
const AGAIN: f64 = 0.4;

/// Rows of a recording without a packet.
pub(crate) struct Missed {
    /// Rows without information on the transmission: losses, and edges of a hold moved by jitter.
    pub(crate) rows: Vec<bool>,
    /// Whether they are losses.
    pub(super) are_lost: bool,
}

/// Rows whose value and number are those of the row before, though the command had moved, in each recording. A hold is no
/// loss, and without repeats nothing is.
pub(crate) fn missed(rig: &CommandRig, pieces: &[Piece]) -> Vec<Missed> {
    missed_in(&echoes(rig, &Behind::of(&rig.values), pieces))
}

/// The same of recordings behind something else than the model has.
pub(super) fn missed_in(echoes: &[Echo]) -> Vec<Missed> {
    let held: Vec<Vec<bool>> = echoes.iter().map(Echo::held).collect();
    let of = |(Echo { piece, .. }, own): (&Echo, &Vec<bool>)| {
        let same = |other: &&Echo| other.piece.experiment == piece.experiment && other.piece.repeat != piece.repeat;
        let others: Vec<&Vec<bool>> =
            echoes.iter().zip(&held).filter(|(other, _)| same(other)).map(|(_, held)| held).collect();
        let common = |row: usize| own[row] && others.iter().all(|held| held.get(row) == Some(&true));
        let common: Vec<bool> = (0..own.len()).map(common).collect();
        let are_lost = !is_hold(own, &common);
        let rows = own.iter().zip(&common).map(|(held, common)| *held && (are_lost || !common)).collect();
        Missed { rows, are_lost }
    };
    echoes.iter().zip(&held).map(of).collect()
}

/// Whether rows without a packet are those of a hold: the same in all repeats, or the usual thing after a packet.
fn is_hold(own: &[bool], common: &[bool]) -> bool {
    let count = |rows: &[bool]| rows.iter().filter(|row| **row).count();
    let came = own.windows(2).filter(|pair| !pair[0]).count();
    let again = own.windows(2).filter(|pair| !pair[0] && !pair[1]).count();
    2 * count(common) > count(own) || (again as f64) < AGAIN * came as f64
}

/// A recording with what came before lag and limit.
pub(super) struct Echo<'a> {
    pub(super) piece: &'a Piece,
    /// Commands that the packets brought \[rad\].
    pub(super) arrived: Vec<f64>,
    /// Rows in which the limit hides them.
    pub(super) limited: Vec<bool>,
    /// What they are known to \[rad\].
    resolution: f64,
    /// The change of a command from which on a missed packet shows \[rad\].
    least: f64,
    /// Rows by which a command comes late by the model.
    late: usize,
}

/// Recordings with what came before such a lag and limit.
pub(super) fn echoes<'a>(rig: &CommandRig, behind: &Behind, pieces: &'a [Piece]) -> Vec<Echo<'a>> {
    pieces.iter().map(|piece| Echo::of(rig, behind, piece)).collect()
}

impl<'a> Echo<'a> {
    fn of(rig: &CommandRig, behind: &Behind, piece: &'a Piece) -> Self {
        let (received, step) = (&piece.signals["received"], piece.step);
        let quantum = rig.quantum.max(f64::EPSILON);
        let limited = |row: usize| row > 0 && behind.limits(received[row] - received[row - 1], step);
        let rounding = quantum * behind.magnified(step);
        let (resolution, least) = match rounding > quantum {
            true => (FAR * rounding, 2.0 * FAR * rounding),
            false => (quantum, MOVED * quantum),
        };
        let limited = (0..received.len()).map(limited).collect();
        let late = ((rig.values.transport_delay + rig.values.delay) / step).round().max(0.0) as usize;
        Self { piece, arrived: behind.arrived(received, step), limited, resolution, least, late }
    }

    /// Whether the command that comes at a row had moved, and nothing hides what came of it.
    pub(super) fn shows(&self, row: usize) -> bool {
        !self.limited[row] && self.moved(row) > self.least
    }

    /// By how much the command that comes at a row had moved \[rad\].
    fn moved(&self, row: usize) -> f64 {
        let sent = &self.piece.signals["sent"];
        let due = row.checked_sub(self.late).filter(|due| *due > 0);
        due.map_or(0.0, |due| (sent[due] - sent[due - 1]).abs())
    }

    /// Whether a row's command changed by some, up to so many times what it is known to, and by far less than it had moved.
    pub(super) fn hardly_changed(&self, row: usize, most: f64) -> bool {
        let is_little =
            |change: f64| (0.5..most + 0.5).contains(&(change / self.resolution)) && 2.0 * change < self.moved(row);
        self.changed(row).is_some_and(is_little)
    }

    /// By how much the command that came changed at a row, though it had moved; whatever packet brought it.
    fn changed(&self, row: usize) -> Option<f64> {
        self.shows(row).then(|| (self.arrived[row] - self.arrived[row - 1]).abs())
    }

    /// Rows whose value and number are those of the row before, though the command had moved.
    fn held(&self) -> Vec<bool> {
        let number = self.piece.signals.get("received.sequence");
        let has_number_before = |row: usize| number.is_none_or(|number| (number[row] - number[row - 1]).abs() < 0.5);
        let has_value_before = |row: usize| self.changed(row).is_some_and(|change| change < 0.5 * self.resolution);
        (0..self.arrived.len()).map(|row| has_value_before(row) && has_number_before(row)).collect()
    }
}
