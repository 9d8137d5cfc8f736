//! The emulated Net Box: streams the measurements of the facility's sensor to the client of the last request.

use super::calibration::NetFtCalibration;
use super::rdt::{RdtCommand, RdtRecord, RdtRequest, STATUS_ERROR, STATUS_SATURATED};
use crate::protocol::{Outbox, SensorBox};
use crate::signals::ForceSample;
use crate::time::Nanos;
use softdock_kernels::space::Wrench;
use std::net::SocketAddr;

/// An error bit of the emulated box: its configuration does not match its transducer.
const STATUS_MISMATCH: u32 = 0x0080_0000;

/// An emulated Net Box.
pub struct NetBox {
    calibration: NetFtCalibration,
    period: Nanos,
    client: Option<SocketAddr>,
    /// Remaining records of the client; `None`: endless.
    wanted: Option<u32>,
    rdt_sequence: u32,
    ft_sequence: u32,
    /// Measured samples per record.
    measured_per_record: u32,
    bias: Wrench<f64>,
    bias_wanted: bool,
}

impl NetBox {
    /// Creates a box that sends a record each `period` (1 to 7 kHz) and measures at 7 kHz.
    pub fn new(calibration: NetFtCalibration, period: Nanos) -> Self {
        let measured_per_record = (period.seconds() * 7000.0).round().max(1.0) as u32;
        Self {
            calibration,
            period,
            client: None,
            wanted: None,
            rdt_sequence: 0,
            ft_sequence: 0,
            measured_per_record,
            bias: Wrench::zero(),
            bias_wanted: false,
        }
    }

    /// Returns the scale of its counts.
    pub fn calibration(&self) -> &NetFtCalibration {
        &self.calibration
    }

    /// Returns the client of the stream.
    pub fn client(&self) -> Option<SocketAddr> {
        self.client
    }
}

impl SensorBox for NetBox {
    fn period(&self) -> Nanos {
        self.period
    }

    fn take(&mut self, _now: Nanos, from: SocketAddr, datagram: &[u8], _out: Outbox) {
        let Some(request) = RdtRequest::read(datagram) else {
            return;
        };
        match request.command {
            RdtCommand::Stream | RdtCommand::StreamBuffered => {
                self.client = Some(from);
                self.wanted = (request.count > 0).then_some(request.count);
                self.rdt_sequence = 0;
            }
            RdtCommand::Stop => self.client = self.client.filter(|client| *client != from),
            RdtCommand::Bias => self.bias_wanted = true,
            RdtCommand::ResetThresholds => {}
        }
    }

    fn report(&mut self, _now: Nanos, sample: &ForceSample, out: Outbox) {
        self.ft_sequence = self.ft_sequence.wrapping_add(self.measured_per_record);
        if std::mem::take(&mut self.bias_wanted) {
            self.bias = sample.wrench;
        }
        let Some(client) = self.client else {
            return;
        };
        self.rdt_sequence = self.rdt_sequence.wrapping_add(1);
        let mut status = 0;
        if sample.saturated {
            status |= STATUS_SATURATED | STATUS_ERROR;
        }
        if sample.invalid {
            status |= STATUS_MISMATCH | STATUS_ERROR;
        }
        let record = RdtRecord {
            rdt_sequence: self.rdt_sequence,
            ft_sequence: self.ft_sequence,
            status,
            counts: self.calibration.counts(sample.wrench - self.bias),
        };
        out(client, &record.bytes());
        if let Some(wanted) = &mut self.wanted {
            *wanted -= 1;
            if *wanted == 0 {
                self.client = None;
            }
        }
    }
}
