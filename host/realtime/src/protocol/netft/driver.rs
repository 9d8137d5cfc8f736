//! Our side of a Net Box: requests the stream, takes the newest record, supervises that the stream is ours.

use super::calibration::NetFtCalibration;
use super::rdt::{RdtCommand, RdtRecord, RdtRequest};
use crate::protocol::link::{self, Peer, progress};
use crate::signals::{ForceSample, ForceSensor, LinkCounters, LinkFault, Peak};
use crate::time::Nanos;
use crate::wire::Port;
use std::net::SocketAddr;

/// Greatest accepted gap in the record count: 14 s at 7 kHz, longer than any run waits.
const MAX_GAP: i32 = 100_000;

/// Time after our request within which the record count may restart.
const RESTART: Nanos = Nanos::from_millis(100);

/// Reaction to a silent stream: the box may be off, or stream to another client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnSilence {
    /// Request the stream again while the silence lasts: for a dry run.
    Request,
    /// Stop with a fault: for armed robots, where the operator must check the box.
    Stop,
}

/// Connection settings of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct NetFtSettings {
    /// Address for requests: its host, port 49152.
    pub sensor: SocketAddr,
    /// Scale of its counts.
    pub calibration: NetFtCalibration,
    /// Period of its records.
    pub period: Nanos,
    /// Time without a record that counts as silence; 3 periods by default.
    pub silence: Nanos,
    /// Reaction to silence.
    pub on_silence: OnSilence,
}

impl NetFtSettings {
    /// Creates settings for records each `period`; silence is three periods without a record, and a fault.
    pub fn new(sensor: SocketAddr, calibration: NetFtCalibration, period: Nanos) -> Self {
        Self { sensor, calibration, period, silence: period * 3, on_silence: OnSilence::Stop }
    }
}

/// A link to a force/torque sensor behind a Net Box.
pub struct NetFt<P: Port> {
    port: P,
    settings: NetFtSettings,
    peer: Peer,
    counters: LinkCounters,
    stream: Stream,
    peak: Peak,
    /// Time of the last record or request.
    last_datagram: Nanos,
    /// Whether any record has arrived: before that, silence means that the box is starting its stream.
    begun: bool,
}

/// Progress of the record count.
#[derive(Clone, Copy)]
struct Stream {
    last: Option<RdtRecord>,
    requested: Nanos,
    /// Whether no record has arrived since our request.
    fresh: bool,
}

impl<P: Port> NetFt<P> {
    /// Requests an endless stream.
    ///
    /// # Errors
    /// If the network interface fails.
    pub fn start(port: P, settings: NetFtSettings) -> Result<Self, LinkFault> {
        let now = port.now();
        let stream = Stream { last: None, requested: now, fresh: true };
        let peer = Peer::at(settings.sensor);
        let counters = LinkCounters::default();
        let mut driver =
            Self { port, settings, peer, counters, stream, peak: Peak::default(), last_datagram: now, begun: false };
        driver.request(RdtCommand::Stream)?;
        Ok(driver)
    }

    /// Sets the box's zero to the present load.
    ///
    /// # Errors
    /// If the network interface fails.
    pub fn bias(&mut self) -> Result<(), LinkFault> {
        self.request(RdtCommand::Bias)
    }

    fn request(&mut self, command: RdtCommand) -> Result<(), LinkFault> {
        self.port.send(&RdtRequest { command, count: 0 }.bytes(), self.settings.sensor)?;
        Ok(())
    }

    /// Handles a silent stream.
    fn meet_silence(&mut self) -> Result<(), LinkFault> {
        let now = self.port.now();
        // A box needs a moment to start; a request to a switched-off box is lost and repeated.
        let allowed = if self.begun { self.settings.silence } else { self.settings.silence.max(RESTART) };
        if now - self.last_datagram <= allowed {
            return Ok(());
        }
        if self.settings.on_silence == OnSilence::Stop {
            return Err(LinkFault::Stopped("the force/torque sensor sends no more records"));
        }
        self.last_datagram = now;
        self.stream = Stream { requested: now, fresh: true, ..self.stream };
        self.request(RdtCommand::Stream)
    }
}

/// Takes a record into the stream, or counts its rejection.
fn take(
    settings: &NetFtSettings,
    stream: &mut Stream,
    counters: &mut LinkCounters,
    datagram: &[u8],
    now: Nanos,
) -> Result<Option<ForceSample>, LinkFault> {
    let read = RdtRecord::read(datagram).and_then(|record| Some((record, settings.calibration.wrench(record.counts)?)));
    let Some((record, wrench)) = read else {
        counters.malformed += 1;
        return Ok(None);
    };
    let mut stalled = false;
    if let Some(last) = stream.last {
        let gap = progress(last.rdt_sequence, record.rdt_sequence);
        let restarted = gap <= 0 && now - stream.requested <= RESTART;
        if !stream.fresh && !restarted {
            if gap <= 0 {
                counters.stale += 1;
                return Ok(None);
            }
            if gap > MAX_GAP {
                counters.malformed += 1;
                return Ok(None);
            }
            counters.lost += gap as u64 - 1;
        }
        let measured = progress(last.ft_sequence, record.ft_sequence);
        if measured < 0 && (stream.fresh || gap > 0) {
            return Err(LinkFault::Stopped(
                "the force/torque sensor has restarted: its calibration must be read again",
            ));
        }
        stalled = measured == 0;
    }
    *stream = Stream { last: Some(record), fresh: false, ..*stream };
    Ok(Some(ForceSample {
        saturated: record.is_saturated(),
        invalid: record.is_invalid() || stalled,
        ..ForceSample::new(now, record.ft_sequence, wrench)
    }))
}

impl<P: Port> ForceSensor for NetFt<P> {
    fn period(&self) -> Nanos {
        self.settings.period
    }

    fn latest(&mut self) -> Result<Option<ForceSample>, LinkFault> {
        let Self { port, settings, peer, counters, stream, peak, .. } = self;
        let mut fault = None;
        // A saturation or an error between two reads must not be hidden by a later valid record.
        let (mut saturated, mut invalid) = (false, false);
        let (sample, _) = link::newest(port, link::AT_ONCE, |datagram, from, now| {
            if !peer.admits(from) {
                counters.foreign += 1;
                return None;
            }
            counters.received += 1;
            let sample = take(settings, stream, counters, datagram, now).unwrap_or_else(|restart| {
                fault = Some(restart);
                None
            })?;
            saturated |= sample.saturated;
            invalid |= sample.invalid;
            peak.see(sample.wrench);
            Some(sample)
        })?;
        if let Some(restart) = fault {
            return Err(restart);
        }
        let Some(sample) = sample else {
            self.meet_silence()?;
            return Ok(None);
        };
        (self.last_datagram, self.begun) = (sample.received, true);
        Ok(Some(ForceSample { saturated, invalid, peak: self.peak.read(sample.wrench), ..sample }))
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}

impl<P: Port> Drop for NetFt<P> {
    fn drop(&mut self) {
        // Otherwise the box would stream for ever; a lost request has no consequence.
        let _ = self.request(RdtCommand::Stop);
    }
}
