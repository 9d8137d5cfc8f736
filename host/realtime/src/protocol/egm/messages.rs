//! The two messages of EGM (`abb.egm`, proto2): `EgmRobot` from the robot, `EgmSensor` from us; deg, mm, N, N m.

use super::wire_format::{Fields, Message, Numbers, ProtobufError, WireValue};

/// Joints, or external joints, of a message: up to six.
pub type EgmAxes = Numbers<6>;

/// `MSGTYPE_DATA`: a robot's report.
const TYPE_DATA: u64 = 2;
/// `MSGTYPE_CORRECTION`: a client's targets.
const TYPE_CORRECTION: u64 = 3;
/// `MOTORS_ON`.
const MOTORS_ON: u64 = 1;
/// `MCI_RUNNING` and, when it is not running, `MCI_STOPPED`.
const MCI_RUNNING: u64 = 3;
const MCI_STOPPED: u64 = 2;
/// `RAPID_RUNNING`.
const RAPID_RUNNING: u64 = 2;

/// Joints and external joints of a report or a command, and the tool's pose if reported.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EgmMotion {
    /// Joint angles \[deg\].
    pub joints: EgmAxes,
    /// External joints; a rail in mm.
    pub external: EgmAxes,
    /// Position x, y, z \[mm\] and quaternion u0 (scalar) to u3.
    pub pose: Option<[f64; 7]>,
}

/// A robot's report.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotReport {
    /// Count of its messages.
    pub sequence: u32,
    /// Robot time \[ms\]; wraps after 49.7 days.
    pub time_ms: u32,
    /// Measured motion.
    pub feedback: EgmMotion,
    /// Planned motion.
    pub planned: EgmMotion,
    /// Whether the drives are on; a report without this field counts as on.
    pub motors_on: bool,
    /// Whether EGM runs; likewise.
    pub running: bool,
    /// Whether its RAPID program runs; likewise.
    pub rapid_running: bool,
    /// Whether it has converged to its target.
    pub converged: bool,
    /// Force \[N\] and moment \[N m\] of its own sensor, if it has one.
    pub force: EgmAxes,
    /// Torques of its joints \[N m\], if reported (RobotWare 7).
    pub torque: EgmAxes,
}

impl RobotReport {
    /// Parses a report.
    ///
    /// # Errors
    /// If the bytes are another message, lack header or joints, or a number is not finite.
    pub fn read(datagram: &[u8]) -> Result<Self, ProtobufError> {
        let mut report = Self { motors_on: true, running: true, rapid_running: true, ..Self::default() };
        let mut header = None;
        let mut fields = Fields(datagram);
        while let Some((number, value)) = fields.field()? {
            match number {
                1 => header = Some(read_header(value)?),
                2 => report.feedback = read_motion(value)?,
                3 => report.planned = read_motion(value)?,
                4 => report.motors_on = read_state(value)? == MOTORS_ON,
                5 => report.running = read_state(value)? == MCI_RUNNING,
                6 => report.converged = value.u32()? != 0,
                8 => report.rapid_running = read_state(value)? == RAPID_RUNNING,
                9 => report.force = read_force(value)?,
                14 => report.torque = read_axes(value)?,
                _ => {}
            }
        }
        let header = header.ok_or(ProtobufError)?;
        (report.sequence, report.time_ms) = (header.sequence, header.time_ms);
        if report.feedback.joints.as_slice().is_empty() { Err(ProtobufError) } else { Ok(report) }
    }

    /// Serialises the message; forces in the layout of RobotWare 7, in which `fcActive` comes first.
    pub fn message(&self) -> Message {
        let mut message = Message::default();
        write_header(&mut message, self.sequence, self.time_ms, TYPE_DATA);
        message.message(2, |inner| write_motion(inner, &self.feedback));
        message.message(3, |inner| write_motion(inner, &self.planned));
        message.message(4, |inner| inner.number(1, if self.motors_on { MOTORS_ON } else { 2 }));
        message.message(5, |inner| inner.number(1, if self.running { MCI_RUNNING } else { MCI_STOPPED }));
        message.number(6, u64::from(self.converged));
        message.message(8, |inner| inner.number(1, if self.rapid_running { RAPID_RUNNING } else { 1 }));
        if !self.force.as_slice().is_empty() {
            message.message(9, |inner| {
                inner.number(1, 1);
                inner.doubles(2, self.force.as_slice());
            });
        }
        if !self.torque.as_slice().is_empty() {
            message.message(14, |inner| inner.doubles(1, self.torque.as_slice()));
        }
        message
    }
}

/// A client's targets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorCommand {
    /// Count of its messages.
    pub sequence: u32,
    /// Its time \[ms\].
    pub time_ms: u32,
    /// Targets of joints and external joints.
    pub planned: EgmMotion,
}

impl SensorCommand {
    /// Parses a command, as an emulated robot does.
    ///
    /// # Errors
    /// If the bytes are no correction, lack the header, or a number is not finite.
    pub fn read(datagram: &[u8]) -> Result<Self, ProtobufError> {
        let mut command = Self::default();
        let mut header = None;
        let mut fields = Fields(datagram);
        while let Some((number, value)) = fields.field()? {
            match number {
                1 => header = Some(read_header(value)?),
                2 => command.planned = read_motion(value)?,
                _ => {}
            }
        }
        let header = header.filter(|header| header.kind == TYPE_CORRECTION).ok_or(ProtobufError)?;
        (command.sequence, command.time_ms) = (header.sequence, header.time_ms);
        Ok(command)
    }

    /// Serialises the message.
    pub fn message(&self) -> Message {
        let mut message = Message::default();
        write_header(&mut message, self.sequence, self.time_ms, TYPE_CORRECTION);
        message.message(2, |inner| write_motion(inner, &self.planned));
        message
    }
}

#[derive(Default)]
struct Header {
    sequence: u32,
    time_ms: u32,
    kind: u64,
}

fn read_header(value: WireValue) -> Result<Header, ProtobufError> {
    let mut header = Header::default();
    let mut fields = value.message()?;
    while let Some((number, value)) = fields.field()? {
        match number {
            1 => header.sequence = value.u32()?,
            2 => header.time_ms = value.u32()?,
            3 => header.kind = value.u32()?.into(),
            _ => {}
        }
    }
    Ok(header)
}

fn write_header(message: &mut Message, sequence: u32, time_ms: u32, kind: u64) {
    message.message(1, |inner| {
        inner.number(1, sequence.into());
        inner.number(2, time_ms.into());
        inner.number(3, kind);
    });
}

/// `EgmFeedBack` and `EgmPlanned` have the same fields.
fn read_motion(value: WireValue) -> Result<EgmMotion, ProtobufError> {
    let mut motion = EgmMotion::default();
    let mut fields = value.message()?;
    while let Some((number, value)) = fields.field()? {
        match number {
            1 => motion.joints = read_axes(value)?,
            2 => motion.pose = read_pose(value)?,
            3 => motion.external = read_axes(value)?,
            _ => {}
        }
    }
    Ok(motion)
}

fn write_motion(message: &mut Message, motion: &EgmMotion) {
    message.message(1, |inner| inner.doubles(1, motion.joints.as_slice()));
    if let Some([x, y, z, turn @ ..]) = motion.pose {
        message.message(2, |inner| {
            inner.message(1, |position| write_numbered(position, &[x, y, z]));
            inner.message(2, |orientation| write_numbered(orientation, &turn));
        });
    }
    if !motion.external.as_slice().is_empty() {
        message.message(3, |inner| inner.doubles(1, motion.external.as_slice()));
    }
}

/// Adds numbers as fields 1, 2, 3 and so on.
fn write_numbered(message: &mut Message, values: &[f64]) {
    for (number, &value) in (1..).zip(values) {
        message.double(number, value);
    }
}

fn read_axes(value: WireValue) -> Result<EgmAxes, ProtobufError> {
    let mut axes = EgmAxes::default();
    let mut fields = value.message()?;
    while let Some((number, value)) = fields.field()? {
        if number == 1 {
            axes.take(value)?;
        }
    }
    Ok(axes)
}

/// Returns a pose if both position and quaternion are complete.
fn read_pose(value: WireValue) -> Result<Option<[f64; 7]>, ProtobufError> {
    let mut pose = [0.0; 7];
    let mut seen = 0u8;
    let mut fields = value.message()?;
    while let Some((part, value)) = fields.field()? {
        let (first, length) = match part {
            1 => (0, 3),
            2 => (3, 4),
            _ => continue,
        };
        let mut parts = value.message()?;
        while let Some((number, value)) = parts.field()? {
            if (1..=length).contains(&number) {
                let index = first + number as usize - 1;
                pose[index] = value.f64()?;
                seen |= 1 << index;
            }
        }
    }
    Ok((seen == 0b111_1111).then_some(pose))
}

/// Reads the one enumeration in a state message.
fn read_state(value: WireValue) -> Result<u64, ProtobufError> {
    let mut state = 0;
    let mut fields = value.message()?;
    while let Some((number, value)) = fields.field()? {
        if number == 1 {
            state = value.u32()?.into();
        }
    }
    Ok(state)
}

/// RobotWare 6 has the forces as field 1; RobotWare 7 has a flag there and the forces as field 2.
fn read_force(value: WireValue) -> Result<EgmAxes, ProtobufError> {
    let mut force = EgmAxes::default();
    let mut active = true;
    let mut fields = value.message()?;
    while let Some((number, value)) = fields.field()? {
        match (number, value) {
            (1, WireValue::Varint(flag)) => active = flag != 0,
            (1 | 2, value) => force.take(value)?,
            _ => {}
        }
    }
    Ok(if active { force } else { EgmAxes::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_command() {
        let planned = EgmMotion { joints: EgmAxes::of(&[1.0]), external: EgmAxes::of(&[-2.0]), pose: None };
        let message = SensorCommand { sequence: 5, time_ms: 130, planned }.message();
        let golden = [
            0x0A, 7, 0x08, 5, 0x10, 0x82, 0x01, 0x18, 3, //
            0x12, 22, 0x0A, 9, 0x09, 0, 0, 0, 0, 0, 0, 0xF0, 0x3F, 0x1A, 9, 0x09, 0, 0, 0, 0, 0, 0, 0, 0xC0,
        ];
        assert_eq!(message.as_bytes(), Some(&golden[..]));
    }

    #[test]
    fn forces_of_both_robotware_versions_are_read() {
        let report = RobotReport {
            feedback: EgmMotion { joints: EgmAxes::of(&[0.0; 6]), ..EgmMotion::default() },
            ..RobotReport::default()
        };
        let with_force = |fill: fn(&mut Message)| {
            let mut message = report.message();
            message.message(9, fill);
            RobotReport::read(message.as_bytes().unwrap()).unwrap().force
        };
        assert_eq!(with_force(|force| force.doubles(1, &[7.0; 6])), EgmAxes::of(&[7.0; 6]));
        assert_eq!(
            with_force(|force| {
                force.number(1, 1);
                force.doubles(2, &[7.0; 6])
            }),
            EgmAxes::of(&[7.0; 6])
        );
        assert_eq!(
            with_force(|force| {
                force.number(1, 0);
                force.doubles(2, &[7.0; 6])
            }),
            EgmAxes::default()
        );
    }

    #[test]
    fn other_messages_are_refused() {
        assert_eq!(RobotReport::read(&[]), Err(ProtobufError));
        let command = SensorCommand::default().message();
        assert_eq!(RobotReport::read(command.as_bytes().unwrap()), Err(ProtobufError));
        let wild = EgmMotion { joints: EgmAxes::of(&[f64::INFINITY]), ..EgmMotion::default() };
        let report = RobotReport { feedback: wild, ..RobotReport::default() }.message();
        assert_eq!(RobotReport::read(report.as_bytes().unwrap()), Err(ProtobufError));
        assert_eq!(SensorCommand::read(report.as_bytes().unwrap()), Err(ProtobufError));
    }

    proptest! {
        #[test]
        fn reports_return(joints in prop::array::uniform6(-360.0..360.0f64), rail in -1e4..1e4f64, sequence: u32,
            time_ms: u32, flags: [bool; 4], force: bool) {
            let feedback = EgmMotion { joints: EgmAxes::of(&joints), external: EgmAxes::of(&[rail]), pose: Some([1.0; 7]) };
            let [motors_on, running, rapid_running, converged] = flags;
            let force = if force { EgmAxes::of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) } else { EgmAxes::default() };
            let planned = EgmMotion { pose: None, ..feedback };
            let torque = force;
            let report = RobotReport { sequence, time_ms, feedback, planned, motors_on, running, rapid_running, converged,
                force, torque };
            prop_assert_eq!(RobotReport::read(report.message().as_bytes().unwrap()), Ok(report));
        }

        #[test]
        fn commands_return(joints in prop::array::uniform6(-360.0..360.0f64), sequence: u32, time_ms: u32) {
            let planned = EgmMotion { joints: EgmAxes::of(&joints), ..EgmMotion::default() };
            let command = SensorCommand { sequence, time_ms, planned };
            prop_assert_eq!(SensorCommand::read(command.message().as_bytes().unwrap()), Ok(command));
        }
    }
}
