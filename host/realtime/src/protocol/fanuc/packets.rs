//! The packets of Stream Motion, big-endian, of fixed lengths; angles in deg, lengths in mm.

/// Axes in a packet; the last three of a six-axis arm are 0.
pub const WIRE_AXES: usize = 9;
/// Protocol version of every controller.
pub const BASE_VERSION: u32 = 3;

/// Marks the values of a command as joint angles. Any other value, and above all 0, marks a Cartesian pose, to which
/// the robot would move.
const STYLE_JOINTS: u16 = 0xFFFF;
const IO_BYTES: usize = 256;

const TYPE_STOP: u32 = 2;
const TYPE_CAPABILITY: u32 = 7;
const TYPE_START: u32 = 200;
const TYPE_COMMAND: u32 = 201;
const TYPE_STATUS: u32 = 202;
const TYPE_STATUS_FORCE: u32 = 204;

const SHORT: usize = 8;
const CAPABILITY: usize = 28;
const COMMAND: usize = 344;
const STATUS: usize = 388;
const STATUS_FORCE: usize = 416;
/// Longest packet.
pub const MAX_PACKET: usize = STATUS_FORCE;

/// A packet under construction.
pub struct Packet {
    bytes: [u8; MAX_PACKET],
    length: usize,
}

impl Packet {
    fn of(words: &[u32]) -> Self {
        let mut packet = Self { bytes: [0; MAX_PACKET], length: 0 };
        words.iter().for_each(|word| packet.put(&word.to_be_bytes()));
        packet
    }

    /// Every caller stays within the packet's fixed length.
    fn put(&mut self, bytes: &[u8]) {
        self.bytes[self.length..self.length + bytes.len()].copy_from_slice(bytes);
        self.length += bytes.len();
    }

    /// Adds zeros up to the packet's fixed length.
    fn padded_to(mut self, length: usize) -> Self {
        self.length = length;
        self
    }

    /// Returns the bytes to send.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// Reads words of a packet whose length has been checked.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn at<const N: usize>(&self, place: usize) -> [u8; N] {
        let mut word = [0; N];
        if let Some(bytes) = self.0.get(place..place + N) {
            word.copy_from_slice(bytes);
        }
        word
    }

    fn u32(&self, place: usize) -> u32 {
        u32::from_be_bytes(self.at(place))
    }

    fn f32s<const N: usize>(&self, place: usize) -> [f32; N] {
        std::array::from_fn(|index| f32::from_be_bytes(self.at(place + 4 * index)))
    }
}

/// Request of a client.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FanucRequest {
    /// Ends the stream.
    Stop,
    /// Requests version and rate.
    Capability,
    /// Begins the stream in this version.
    Start(u32),
    /// Commands joint targets.
    Command(FanucCommand),
}

/// Joint targets of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FanucCommand {
    /// Negotiated version.
    pub version: u32,
    /// Number of the answered status.
    pub sequence: u32,
    /// Whether this is the last command.
    pub last: bool,
    /// Joint angles \[deg\].
    pub joints: [f64; WIRE_AXES],
}

impl FanucRequest {
    /// Serialises the request.
    pub fn packet(&self) -> Packet {
        match self {
            Self::Stop => Packet::of(&[TYPE_STOP, BASE_VERSION]),
            Self::Capability => Packet::of(&[TYPE_CAPABILITY, BASE_VERSION, 1, 0, 0, 0, 0]),
            Self::Start(version) => Packet::of(&[TYPE_START, *version]),
            Self::Command(command) => {
                let mut packet = Packet::of(&[TYPE_COMMAND, command.version, command.sequence]);
                // Last command flag, motion flag.
                packet.put(&[u8::from(command.last), 1]);
                packet.put(&STYLE_JOINTS.to_be_bytes());
                command.joints.iter().for_each(|angle| packet.put(&angle.to_be_bytes()));
                packet.padded_to(COMMAND)
            }
        }
    }

    /// Parses a request, as an emulated controller does; `None` for other packets, and for commands without finite
    /// joint angles.
    pub fn read(datagram: &[u8]) -> Option<Self> {
        let words = Words(datagram);
        match (datagram.len(), words.u32(0)) {
            (SHORT, TYPE_STOP) => Some(Self::Stop),
            (CAPABILITY, TYPE_CAPABILITY) => Some(Self::Capability),
            (SHORT, TYPE_START) => Some(Self::Start(words.u32(4))),
            (COMMAND, TYPE_COMMAND) => {
                let [last, motion] = words.at(12);
                let joints = std::array::from_fn(|axis| f64::from_be_bytes(words.at(16 + 8 * axis)));
                let usable = motion == 1
                    && u16::from_be_bytes(words.at(14)) == STYLE_JOINTS
                    && joints.iter().all(|angle: &f64| angle.is_finite());
                let (version, sequence) = (words.u32(4), words.u32(8));
                usable.then_some(Self::Command(FanucCommand { version, sequence, last: last != 0, joints }))
            }
            _ => None,
        }
    }
}

/// Reply of a controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FanucReply {
    /// Capabilities.
    Capability(Capability),
    /// Status.
    Status(FanucStatus),
}

/// Capabilities of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capability {
    /// Period of its status \[ms\].
    pub period_ms: u32,
    /// Newest supported protocol version; start and commands must state it.
    pub version: u32,
}

/// Status of a controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FanucStatus {
    /// Negotiated version: 4 and up have the force block.
    pub version: u32,
    /// Count of status packets.
    pub sequence: u32,
    /// Bits: 0 ready for commands, 3 moving.
    pub status: u8,
    /// Bits: 0 error, 1 teach pendant on, 2 emergency stop.
    pub robot_status: u8,
    /// Contact stop of a collaborative robot: 0 none, 1 safe, 2 stopped, 3 disabled, 4 escaping.
    pub contact_stop: u8,
    /// Controller time \[ms\]; wraps after 49.7 days.
    pub time_stamp: u32,
    /// Pose of the faceplate: X, Y, Z \[mm\], W, P, R \[deg\], extended axes.
    pub pose: [f32; WIRE_AXES],
    /// Measured joint angles \[deg\].
    pub joints: [f32; WIRE_AXES],
    /// Motor currents, in the controller's units.
    pub currents: [f32; WIRE_AXES],
    /// Share of the speed that safety functions permit.
    pub safety_scale: f32,
    /// Force \[N\] and moment \[N m\] of its own sensor, from version 4 on.
    pub force: Option<[f32; 6]>,
}

impl FanucStatus {
    /// Whether it follows commands: ready, no error, no stop.
    pub fn is_ready(&self) -> bool {
        self.waits_for_commands() && self.is_sound()
    }

    /// Whether it has neither error nor stop.
    pub fn is_sound(&self) -> bool {
        self.robot_status & 0b101 == 0 && !matches!(self.contact_stop, 2 | 4)
    }

    /// Whether it is ready for commands.
    pub fn waits_for_commands(&self) -> bool {
        self.status & 1 != 0
    }
}

impl FanucReply {
    /// Serialises the reply.
    pub fn packet(&self) -> Packet {
        match self {
            Self::Capability(capability) => {
                let (period, version) = (capability.period_ms, capability.version);
                Packet::of(&[TYPE_CAPABILITY, version, 1, period, 0, version, 0])
            }
            Self::Status(status) => {
                let kind = if status.force.is_some() { TYPE_STATUS_FORCE } else { TYPE_STATUS };
                let mut packet = Packet::of(&[kind, status.version, status.sequence]);
                packet.put(&[status.status, status.robot_status, status.contact_stop, 0]);
                packet.put(&status.time_stamp.to_be_bytes());
                let axes = status.pose.iter().chain(&status.joints).chain(&status.currents);
                axes.chain([&status.safety_scale]).for_each(|value| packet.put(&value.to_be_bytes()));
                let Some(force) = status.force else {
                    return packet.padded_to(STATUS);
                };
                force.iter().for_each(|value| packet.put(&value.to_be_bytes()));
                packet.padded_to(STATUS_FORCE)
            }
        }
    }

    /// Parses a reply; `None` for other packets.
    pub fn read(datagram: &[u8]) -> Option<Self> {
        let words = Words(datagram);
        match (datagram.len(), words.u32(0)) {
            (CAPABILITY, TYPE_CAPABILITY) => {
                Some(Self::Capability(Capability { period_ms: words.u32(12), version: words.u32(20) }))
            }
            (STATUS, TYPE_STATUS) => Some(Self::Status(read_status(&words, None))),
            (STATUS_FORCE, TYPE_STATUS_FORCE) => Some(Self::Status(read_status(&words, Some(words.f32s(132))))),
            _ => None,
        }
    }
}

fn read_status(words: &Words, force: Option<[f32; 6]>) -> FanucStatus {
    let [status, robot_status, contact_stop, _] = words.at(12);
    let [safety_scale] = words.f32s(128);
    FanucStatus {
        version: words.u32(4),
        sequence: words.u32(8),
        status,
        robot_status,
        contact_stop,
        time_stamp: words.u32(16),
        pose: words.f32s(20),
        joints: words.f32s(56),
        currents: words.f32s(92),
        safety_scale,
        force,
    }
}

// The inputs and outputs at the end of commands and status are not used: they stay zero.
const _: () = assert!(COMMAND == 16 + 8 * WIRE_AXES + IO_BYTES && STATUS == 132 + IO_BYTES);
const _: () = assert!(STATUS_FORCE == STATUS + 28);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_requests() {
        assert_eq!(FanucRequest::Stop.packet().as_bytes(), [0, 0, 0, 2, 0, 0, 0, 3]);
        assert_eq!(FanucRequest::Start(4).packet().as_bytes(), [0, 0, 0, 200, 0, 0, 0, 4]);
        let capability = FanucRequest::Capability.packet();
        assert_eq!(capability.as_bytes()[..12], [0, 0, 0, 7, 0, 0, 0, 3, 0, 0, 0, 1]);
        assert_eq!(capability.as_bytes()[12..], [0; 16]);
    }

    #[test]
    fn golden_command() {
        let mut joints = [0.0; WIRE_AXES];
        joints[0] = 1.0;
        let command = FanucCommand { version: 3, sequence: 42, last: true, joints };
        let packet = FanucRequest::Command(command).packet();
        let bytes = packet.as_bytes();
        assert_eq!(bytes.len(), 344);
        assert_eq!(bytes[..16], [0, 0, 0, 201, 0, 0, 0, 3, 0, 0, 0, 42, 1, 1, 0xFF, 0xFF]);
        assert_eq!(bytes[16..24], [0x3F, 0xF0, 0, 0, 0, 0, 0, 0]);
        assert!(bytes[24..].iter().all(|&byte| byte == 0));
        assert_eq!(FanucRequest::read(bytes), Some(FanucRequest::Command(command)));
        // A Cartesian command, one without motion, and one that is not finite.
        for (place, value) in [(14, 0), (13, 0), (16, 0x7F)] {
            let mut other = bytes.to_vec();
            other[place] = value;
            assert_eq!(FanucRequest::read(&other), None, "{place}");
        }
    }

    fn status(force: Option<[f32; 6]>) -> FanucStatus {
        FanucStatus {
            version: 4,
            sequence: 258,
            status: 9,
            robot_status: 4,
            contact_stop: 2,
            time_stamp: 65_536,
            pose: [1.0; 9],
            joints: std::array::from_fn(|axis| axis as f32),
            currents: [-2.0; 9],
            safety_scale: 0.5,
            force,
        }
    }

    #[test]
    fn golden_status() {
        let packet = FanucReply::Status(status(None)).packet();
        let bytes = packet.as_bytes();
        assert_eq!(bytes.len(), 388);
        assert_eq!(bytes[..20], [0, 0, 0, 202, 0, 0, 0, 4, 0, 0, 1, 2, 9, 4, 2, 0, 0, 1, 0, 0]);
        assert_eq!(bytes[60..64], [0x3F, 0x80, 0, 0]);
        assert_eq!(bytes[128..132], [0x3F, 0, 0, 0]);
        let packet = FanucReply::Status(status(Some([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))).packet();
        let bytes = packet.as_bytes();
        assert_eq!((bytes.len(), bytes[3]), (416, 204));
        assert_eq!(bytes[152..156], [0x40, 0xC0, 0, 0]);
        assert_eq!(FanucReply::read(&bytes[..415]), None);
    }

    proptest! {
        #[test]
        fn status_returns(joints in prop::array::uniform9(-360.0..360.0f32), sequence: u32, time_stamp: u32, force: bool) {
            let force = force.then_some([1.5, -2.5, 3.5, 0.1, 0.2, 0.3]);
            let reply = FanucReply::Status(FanucStatus { joints, sequence, time_stamp, ..status(force) });
            prop_assert_eq!(FanucReply::read(reply.packet().as_bytes()), Some(reply));
        }

        #[test]
        fn commands_return(joints in prop::array::uniform9(-360.0..360.0f64), sequence: u32, last: bool) {
            let request = FanucRequest::Command(FanucCommand { version: 3, sequence, last, joints });
            prop_assert_eq!(FanucRequest::read(request.packet().as_bytes()), Some(request));
        }
    }
}
