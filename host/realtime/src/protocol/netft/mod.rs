//! ATI Net F/T: wrenches as raw data transfer (RDT) over UDP, and the calibration that scales them over HTTP.
//!
//! [`rdt`] is the codec, [`calibration`] the contents of `netftapi2.xml`, [`http`] its transfer, [`driver`] our side,
//! [`sensor_box`] the emulated Net Box.

pub mod calibration;
pub mod driver;
pub mod http;
pub mod rdt;
pub mod sensor_box;
#[cfg(test)]
mod tests;

/// Default port of a Net Box for requests.
pub const RDT_PORT: u16 = 49152;
/// Default port of a Net Box for its calibration.
pub const HTTP_PORT: u16 = 80;
/// Default records per second of a Net Box.
pub const RATE_HZ: f64 = 1000.0;
