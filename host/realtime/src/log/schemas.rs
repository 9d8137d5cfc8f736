//! Message definitions of ROS 2, each with its dependencies, and our own message from the log's table.

use super::table::{LogColumn, Type};
use std::fmt::Write;

/// Separator between the definitions of one schema text.
const RULE: &str = "================================================================================";

const HEADER: (&str, &str) = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp
string frame_id
",
);
const TIME: (&str, &str) = (
    "builtin_interfaces/Time",
    "int32 sec
uint32 nanosec
",
);
const VECTOR3: (&str, &str) = (
    "geometry_msgs/Vector3",
    "float64 x
float64 y
float64 z
",
);
const QUATERNION: (&str, &str) = (
    "geometry_msgs/Quaternion",
    "float64 x 0
float64 y 0
float64 z 0
float64 w 1
",
);
const WRENCH: (&str, &str) = (
    "geometry_msgs/Wrench",
    "Vector3 force
Vector3 torque
",
);
const TRANSFORM: (&str, &str) = (
    "geometry_msgs/Transform",
    "Vector3 translation
Quaternion rotation
",
);
const TRANSFORM_STAMPED: (&str, &str) = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header
string child_frame_id
Transform transform
",
);

/// A message type: its name and the text of its definition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// Name of the type (`tf2_msgs/msg/TFMessage`).
    pub name: &'static str,
    /// Definition, with those of the types that it needs.
    pub text: String,
}

fn schema(name: &'static str, definition: &str, needs: &[(&str, &str)]) -> Schema {
    let mut text = definition.to_owned();
    for (needed, definition) in needs {
        let _ = write!(text, "{RULE}\nMSG: {needed}\n{definition}");
    }
    Schema { name, text }
}

/// Names, positions, velocities and efforts of joints.
pub fn joint_state() -> Schema {
    let definition = "std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
";
    schema("sensor_msgs/msg/JointState", definition, &[HEADER, TIME])
}

/// A wrench with its time and frame.
pub fn wrench_stamped() -> Schema {
    let definition = "std_msgs/Header header
geometry_msgs/Wrench wrench
";
    schema("geometry_msgs/msg/WrenchStamped", definition, &[HEADER, TIME, WRENCH, VECTOR3])
}

/// Transforms from parents to children.
pub fn tf_message() -> Schema {
    let definition = "geometry_msgs/TransformStamped[] transforms
";
    let needs = [TRANSFORM_STAMPED, HEADER, TIME, TRANSFORM, VECTOR3, QUATERNION];
    schema("tf2_msgs/msg/TFMessage", definition, &needs)
}

/// A text.
pub fn string() -> Schema {
    schema("std_msgs/msg/String", "string data\n", &[])
}

/// Name of our own message.
pub(crate) const CYCLE: &str = "softdock_msgs/msg/Cycle";

/// Returns our own message: a header, and one field per column of the log that no standard message has.
pub(crate) fn cycle<'a>(columns: impl Iterator<Item = &'a LogColumn>) -> Schema {
    let mut definition = "std_msgs/Header header\n".to_owned();
    for column in columns {
        let LogColumn { name, unit, meaning, kind } = column;
        let _ = writeln!(definition, "{} {name}  # [{unit}] {meaning}", primitive(*kind));
    }
    schema(CYCLE, &definition, &[HEADER, TIME])
}

/// Returns type and name of each field of our own message, from a file's schema text.
pub(crate) fn cycle_fields(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let own = text.lines().take_while(|line| !line.starts_with(RULE)).skip(1);
    own.filter_map(|line| {
        let mut words = line.split('#').next()?.split_whitespace();
        Some((words.next()?, words.next()?))
    })
}

/// Returns the ROS type of a column.
pub(crate) fn primitive(kind: Type) -> &'static str {
    match kind {
        Type::Real => "float64",
        Type::Signed => "int64",
        Type::Whole => "uint64",
        Type::Word | Type::Code(_) => "uint32",
    }
}
