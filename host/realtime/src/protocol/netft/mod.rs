//! ATI Net F/T: wrenches as raw data transfer (RDT) over UDP, and the calibration that scales them over HTTP.
//!
//! [`rdt`] is the codec, [`calibration`] what `netftapi2.xml` tells, [`http`] how it is fetched and served, [`driver`]
//! our side, [`sensor_box`] the emulated Net Box.

pub mod calibration;
pub mod driver;
pub mod http;
pub mod rdt;
pub mod sensor_box;
#[cfg(test)]
mod tests;

/// Port on which a Net Box takes requests.
pub const RDT_PORT: u16 = 49152;
/// Port on which a Net Box serves its calibration.
pub const HTTP_PORT: u16 = 80;
/// Records that a Net Box sends per second.
pub const RATE_HZ: f64 = 1000.0;
