//! A six-axis force/torque sensor between the wrench that acts on it and the reading behind its load compensation.
//!
//! What was hung on it or struck against it is known; the tool between sensor and load is moved, so that its own weight
//! and inertia act too. The reading is what is left when those of the nominal tool are taken off. Everything in sensor
//! axes about the sensor's origin.

use super::Block;
use super::low_pass::LowPass;
use super::stairs::stepped;
use crate::bundle;
use crate::fields::filled;
use crate::range::UNLIMITED;
use crate::real::Real;
use crate::space::Wrench;
use crate::vector::{Vec3, vec3};

bundle! {
    /// What a channel of the force reads of each component besides its own: errors of a row of the calibration matrix.
    ForceRow {
        force: Vec3<R>, "1", "share of the true force, component by component";
        moment: Vec3<R>, "1/m", "force read per true moment, component by component";
    }
}

bundle! {
    /// The same of a channel of the moment.
    MomentRow {
        force: Vec3<R>, "m", "moment read per true force, component by component";
        moment: Vec3<R>, "1", "share of the true moment, component by component";
    }
}

bundle! {
    /// A sensor's values, effects and what may differ unnoticed.
    SensorValues {
        tool_mass: R, "kg", "mass of the tool between sensor and load";
        tool_centre: Vec3<R>, "m", "its centre of mass";
        tool_inertia: Vec3<R>, "kg m^2", "its moments of inertia about the centre of mass";
        bias_force: Vec3<R>, "N", "force read without any";
        bias_moment: Vec3<R>, "N m", "moment read without any";
        drift_force: Vec3<R>, "N/s", "growth of the bias with the session's time";
        drift_moment: Vec3<R>, "N m/s", "growth of the bias of the moment";
        gain: R, "1", "relative error of all channels alike";
        fx_of: ForceRow<R>, "1", "error of the reading of f_x";
        fy_of: ForceRow<R>, "1", "error of the reading of f_y";
        fz_of: ForceRow<R>, "1", "error of the reading of f_z";
        mx_of: MomentRow<R>, "1", "error of the reading of m_x";
        my_of: MomentRow<R>, "1", "error of the reading of m_y";
        mz_of: MomentRow<R>, "1", "error of the reading of m_z";
        lag: R, "s", "time constant of the low-pass";
        delay: R, "s", "delay of the reading";
        clock_offset: R, "s", "delay of the reading against its time stamp, without a common clock";
        resolution: R, "N", "step of the reading; that of a moment is the lever times as large";
        blur: R, "N", "half the width over which the noise blurs a step";
        range: R, "N", "greatest force that is read; the greatest moment is the lever times as large";
        lever: R, "m", "moments of the sensor's data sheet over its forces";
    }
}

impl SensorValues<f64> {
    /// A sensor without tool, errors or limits.
    pub fn null() -> Self {
        Self { range: UNLIMITED, lever: 0.1, ..filled(0.0) }
    }
}

bundle! {
    /// What is known at an instant of the reading.
    SensorInput {
        compensation: Wrench<R>, "1", "wrench of the nominal tool, which is taken off the reading";
        time: R, "s", "time since the session began";
    }
}

bundle! {
    /// What acts on the sensor, and the motion that makes its tool act too.
    SensorLoad {
        wrench: Wrench<R>, "1", "known wrench on the sensor";
        bend: Wrench<R>, "1", "half the second derivative of the wrench times the square of a step";
        pull: Vec3<R>, "m/s^2", "gravity less the acceleration of the sensor's origin";
        rate: Vec3<R>, "rad/s", "angular rate";
        angular_acceleration: Vec3<R>, "rad/s^2", "angular acceleration";
    }
}

bundle! {
    /// What is hidden in a sensor.
    SensorHidden {
        signal: Wrench<R>, "1", "signal of the sensing element";
        filtered: Wrench<R>, "1", "the same behind the low-pass";
    }
}

bundle! {
    /// Output of a sensor's model for a recording.
    SensorOutput {
        force: Vec3<R>, "N", "force behind the load compensation";
        moment: Vec3<R>, "N m", "moment behind the load compensation";
    }
}

/// Wrench of a tool with this mass \[kg\], centre \[m\] and moments of inertia \[kg m^2\] on the sensor that carries it.
#[inline(always)]
pub fn tool_wrench<R: Real>(mass: R, centre: Vec3<R>, inertia: Vec3<R>, load: &SensorLoad<R>) -> Wrench<R> {
    let turning = load.angular_acceleration.cross(centre) + load.rate.cross(load.rate.cross(centre));
    let force = (load.pull - turning) * mass;
    let scaled = |v: Vec3<R>| v.zip(inertia, |v, inertia| v * inertia);
    let spin = scaled(load.angular_acceleration) + load.rate.cross(scaled(load.rate));
    Wrench { force, moment: centre.cross(force) - spin }
}

/// A six-axis force/torque sensor, from wrench to reading.
#[derive(Clone, Copy, Debug, Default)]
pub struct SensorBlock;

impl Block for SensorBlock {
    type Params<R: Real> = SensorValues<R>;
    type State<R: Real> = SensorHidden<R>;
    type Input<R: Real> = SensorInput<R>;
    type Late<R: Real> = SensorLoad<R>;
    type Output<R: Real> = SensorOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &SensorValues<R>, _time: R) -> R {
        p.delay + p.clock_offset
    }

    #[inline(always)]
    fn start<R: Real>(&self, p: &SensorValues<R>, _u: &SensorInput<R>, late: &SensorLoad<R>) -> SensorHidden<R> {
        let signal = signal(p, late, R::lit(0.0));
        SensorHidden { signal, filtered: signal }
    }

    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &SensorValues<R>,
        s: &SensorHidden<R>,
        u: &SensorInput<R>,
        late: &SensorLoad<R>,
    ) -> SensorHidden<R> {
        let steps = self.lateness(p, u.time) * R::lit(1.0 / step);
        let signal = signal(p, late, steps - steps.floor());
        let low_pass = LowPass::of(step, p.lag);
        let bend = read(p, late.bend);
        let force = low_pass.after_vector(s.signal.force, signal.force, bend.force, s.filtered.force);
        let moment = low_pass.after_vector(s.signal.moment, signal.moment, bend.moment, s.filtered.moment);
        SensorHidden { signal, filtered: Wrench { force, moment } }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        p: &SensorValues<R>,
        s: &SensorHidden<R>,
        u: &SensorInput<R>,
        _late: &SensorLoad<R>,
    ) -> SensorOutput<R> {
        let force = p.drift_force.scale_add(u.time, s.filtered.force + p.bias_force);
        let moment = p.drift_moment.scale_add(u.time, s.filtered.moment + p.bias_moment);
        SensorOutput {
            force: digits(p, force, R::lit(1.0)) - u.compensation.force,
            moment: digits(p, moment, p.lever) - u.compensation.moment,
        }
    }
}

/// Signal of the sensing element at a share of a step between two instants; what a straight line between them lacks is
/// added.
#[inline(always)]
fn signal<R: Real>(p: &SensorValues<R>, late: &SensorLoad<R>, share: R) -> Wrench<R> {
    let lack = share * (share - R::lit(1.0));
    let tool = tool_wrench(p.tool_mass, p.tool_centre, p.tool_inertia, late);
    let force = late.bend.force.scale_add(lack, late.wrench.force + tool.force);
    let moment = late.bend.moment.scale_add(lack, late.wrench.moment + tool.moment);
    read(p, Wrench { force, moment })
}

/// The calibration matrix with its errors applied to a wrench.
#[inline(always)]
fn read<R: Real>(p: &SensorValues<R>, w: Wrench<R>) -> Wrench<R> {
    let by_force = |row: &ForceRow<R>| row.force.dot(w.force) + row.moment.dot(w.moment);
    let by_moment = |row: &MomentRow<R>| row.force.dot(w.force) + row.moment.dot(w.moment);
    let force = vec3(by_force(&p.fx_of), by_force(&p.fy_of), by_force(&p.fz_of));
    let moment = vec3(by_moment(&p.mx_of), by_moment(&p.my_of), by_moment(&p.mz_of));
    Wrench { force: w.force.scale_add(p.gain, w.force) + force, moment: w.moment.scale_add(p.gain, w.moment) + moment }
}

/// The reading within its range and in its steps, both so many times those of a force.
#[inline(always)]
fn digits<R: Real>(p: &SensorValues<R>, v: Vec3<R>, scale: R) -> Vec3<R> {
    let (step, blur) = (p.resolution * scale, p.blur * scale);
    // A closure this long would be called with every instruction of a lane, not inlined.
    let v = v.clamp(p.range * scale);
    vec3(stepped(v.x, step, blur), stepped(v.y, step, blur), stepped(v.z, step, blur))
}
