//! Sensor model: conversion between readings and the wrench on part A, with frame, tool weight and tare.

use softdock_campaign::Station;
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::{Pose, Vec3};

/// Mounting of the sensor, its tool and its tare.
#[derive(Clone, Copy, Debug)]
pub struct Sensing {
    /// Its frame in part A's.
    frame: Pose<f64>,
    tool_mass: f64,
    tool_centre: Vec3<f64>,
    /// Gravity, laboratory axes \[m/s^2\].
    gravity: Vec3<f64>,
    /// Reading without weight and contact, found by taring.
    pub tare: Wrench<f64>,
}

impl Sensing {
    /// Creates the untared sensor of a facility.
    pub fn new(station: &Station) -> Self {
        let sensor = station.sensor;
        let gravity = station.robots[0].mount.base.attitude.rotate(station.model.gravity);
        Self {
            frame: sensor.frame,
            tool_mass: sensor.tool_mass,
            tool_centre: sensor.tool_centre,
            gravity,
            tare: Wrench::zero(),
        }
    }

    /// Returns the wrench on part A about its origin, in its axes, from a reading, without the tool's weight.
    pub fn on_part(&self, reading: Wrench<f64>, a: &Motion<f64>) -> Wrench<f64> {
        let net = reading - self.tare - self.weight(a);
        let force = self.frame.attitude.rotate(net.force);
        Wrench { force, moment: self.frame.attitude.rotate(net.moment) + self.frame.position.cross(force) }
    }

    /// Returns the reading of an unbiased sensor under a wrench on part A.
    pub fn reading(&self, on_part: Wrench<f64>, a: &Motion<f64>) -> Wrench<f64> {
        let moment = on_part.moment - self.frame.position.cross(on_part.force);
        let net = Wrench {
            force: self.frame.attitude.rotate_back(on_part.force),
            moment: self.frame.attitude.rotate_back(moment),
        };
        net + self.weight(a)
    }

    /// Returns the weight of the tool in the sensor's axes.
    pub fn weight(&self, a: &Motion<f64>) -> Wrench<f64> {
        let attitude = a.attitude.compose(self.frame.attitude);
        let force = attitude.rotate_back(self.gravity * self.tool_mass);
        Wrench { force, moment: self.tool_centre.cross(force) }
    }
}
