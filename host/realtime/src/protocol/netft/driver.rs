//! Our side of a Net Box: asks for the stream, takes the newest record, and watches that the stream stays ours.

use super::calibration::NetFtCalibration;
use super::rdt::{RdtCommand, RdtRecord, RdtRequest};
use crate::protocol::link::{self, Peer, progress};
use crate::signals::{ForceSample, ForceSensor, LinkCounters, LinkFault, Peak};
use crate::time::Nanos;
use crate::wire::Port;
use std::net::SocketAddr;

/// Largest gap in the count of records that is believed: 14 s at 7 kHz, longer than any run waits.
const MAX_GAP: i32 = 100_000;

/// How long after our request the count of records may begin anew.
const RESTART: Nanos = Nanos::from_millis(100);

/// What to do when the stream falls silent: the box may be off, or stream to somebody else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnSilence {
    /// Ask for the stream again, as often as the silence lasts: for a dry run.
    Request,
    /// Stop with a fault: when armed, a person has to look.
    Stop,
}

/// How to talk to a box.
#[derive(Clone, Debug, PartialEq)]
pub struct NetFtSettings {
    /// Where it takes requests: its host, port 49152.
    pub sensor: SocketAddr,
    /// What scales its counts.
    pub calibration: NetFtCalibration,
    /// Period of its records.
    pub period: Nanos,
    /// How long without a record is silence; 3 periods by default.
    pub silence: Nanos,
    /// What then.
    pub on_silence: OnSilence,
}

impl NetFtSettings {
    /// Records each `period`; silence is three of them without a record, and a fault.
    pub fn new(sensor: SocketAddr, calibration: NetFtCalibration, period: Nanos) -> Self {
        Self { sensor, calibration, period, silence: period * 3, on_silence: OnSilence::Stop }
    }
}

/// A force/torque sensor behind a Net Box.
pub struct NetFt<P: Port> {
    port: P,
    settings: NetFtSettings,
    peer: Peer,
    counters: LinkCounters,
    stream: Stream,
    peak: Peak,
    /// Last record or request.
    heard: Nanos,
    /// Whether any record has come: silence before that is the box starting its stream.
    begun: bool,
}

/// How far the stream has come.
#[derive(Clone, Copy)]
struct Stream {
    last: Option<RdtRecord>,
    requested: Nanos,
    /// No record has come since our request.
    fresh: bool,
}

impl<P: Port> NetFt<P> {
    /// Asks the box for an endless stream.
    ///
    /// # Errors
    /// If the network interface fails.
    pub fn start(port: P, settings: NetFtSettings) -> Result<Self, LinkFault> {
        let now = port.now();
        let stream = Stream { last: None, requested: now, fresh: true };
        let peer = Peer::at(settings.sensor);
        let counters = LinkCounters::default();
        let mut driver =
            Self { port, settings, peer, counters, stream, peak: Peak::default(), heard: now, begun: false };
        driver.request(RdtCommand::Stream)?;
        Ok(driver)
    }

    /// Makes the present load the sensor's zero, in the box.
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

    /// Meets a stream that has fallen silent.
    fn meet_silence(&mut self) -> Result<(), LinkFault> {
        let now = self.port.now();
        // A box needs a moment to begin; a request to a box that is off goes nowhere and is repeated.
        let allowed = if self.begun { self.settings.silence } else { self.settings.silence.max(RESTART) };
        if now - self.heard <= allowed {
            return Ok(());
        }
        if self.settings.on_silence == OnSilence::Stop {
            return Err(LinkFault::Stopped("the force/torque sensor has fallen silent"));
        }
        self.heard = now;
        self.stream = Stream { requested: now, fresh: true, ..self.stream };
        self.request(RdtCommand::Stream)
    }
}

/// Takes a record into the stream, or counts why not.
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
        // A load that was beyond range or an error between two looks must not go unseen because a later record is good.
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
        (self.heard, self.begun) = (sample.received, true);
        Ok(Some(ForceSample { saturated, invalid, peak: self.peak.look(sample.wrench), ..sample }))
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}

impl<P: Port> Drop for NetFt<P> {
    fn drop(&mut self) {
        // The box would stream for ever; it is no matter here whether this arrives.
        let _ = self.request(RdtCommand::Stop);
    }
}
