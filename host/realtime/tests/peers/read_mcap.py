"""Reads a drive's MCAP log with mcap-ros2-support and compares it with the sample drive that the tests write.

Usage: read_mcap.py FILE, where FILE was written by
    SOFTDOCK_MCAP=FILE cargo test -p softdock-realtime write_a_log_for_others -- --ignored
Needs mcap-ros2-support from PyPI.
"""

import math
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

CYCLES = 2001
STARTED_S = 1_800_000_000
ROBOTS = ["robot_1", "robot_2", "emulated_1", "emulated_2"]
# A dry run: the real robots are commanded to hold, so that they have no commands.
EXPECTED = {f"/{robot}/joint_states": CYCLES for robot in ROBOTS}
EXPECTED |= {f"/{robot}/joint_commands": CYCLES for robot in ROBOTS[2:]}
EXPECTED |= {"/ft/wrench": CYCLES, "/ft/wrench_raw": CYCLES, "/tf": CYCLES, "/hil/cycle": CYCLES}
EXPECTED |= {"/robot_description": 1, "/tf_static": 1}
SCHEMAS = {
    "joint_states": "sensor_msgs/msg/JointState",
    "joint_commands": "sensor_msgs/msg/JointState",
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "wrench_raw": "geometry_msgs/msg/WrenchStamped",
    "tf": "tf2_msgs/msg/TFMessage",
    "tf_static": "tf2_msgs/msg/TFMessage",
    "cycle": "softdock_msgs/msg/Cycle",
    "robot_description": "std_msgs/msg/String",
}


def check(name, found, expected):
    """Ends the program unless two values are the same, real numbers to the last bit."""
    if found != expected:
        sys.exit(f"read_mcap.py: {name}: {found!r}, expected {expected!r}")


def axis(robot, cycle, place):
    """Angle of an axis in the sample drive."""
    return 0.3 * math.sin(0.2 * (cycle * 1e-3) + robot + place)


def check_joints(topic, cycle, message):
    number = ROBOTS.index(topic.split("/")[1]) + 1
    group = (number - 1) % 2 + 1
    names = [f"robot_{group}_joint_{joint}" for joint in range(1, 7)] + [f"robot_{group}_rail"]
    check(f"{topic} names", list(message.name), names)
    command = topic.endswith("commands")
    for place, position in enumerate(message.position):
        expected = axis(number, cycle, place) + (1e-4 if command else 0.0)
        # The sine of another library may differ in its last bit.
        if abs(position - expected) > 1e-15:
            sys.exit(f"read_mcap.py: {topic} axis {place}: {position}, expected {expected}")
    check(f"{topic} positions", len(message.position), 7)
    check(f"{topic} efforts", len(message.effort), 0 if command else 7)


class Pose:
    """A rotation by columns and a translation."""

    def __init__(self, rows=((1, 0, 0), (0, 1, 0), (0, 0, 1)), place=(0, 0, 0)):
        self.rows, self.place = rows, place

    def compose(self, other):
        """The pose of a frame that is posed `other` in this one."""
        columns = list(zip(*other.rows))
        rows = [[sum(a * b for a, b in zip(row, column)) for column in columns] for row in self.rows]
        turned = [sum(a * b for a, b in zip(row, other.place)) for row in self.rows]
        return Pose(rows, [a + b for a, b in zip(self.place, turned)])

    def apart(self, other):
        """Greatest difference of the elements of two poses."""
        rows = [a - b for one, two in zip(self.rows, other.rows) for a, b in zip(one, two)]
        return max(abs(value) for value in rows + [a - b for a, b in zip(self.place, other.place)])


def about(axis, angle):
    """A turn about a coordinate axis, or about its opposite."""
    place = max(range(3), key=lambda index: abs(axis[index]))
    cosine, sine = math.cos(angle), math.copysign(1, axis[place]) * math.sin(angle)
    first, second = (place + 1) % 3, (place + 2) % 3
    rows = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
    rows[place][place] = 1
    rows[first][first] = rows[second][second] = cosine
    rows[second][first], rows[first][second] = sine, -sine
    return Pose(rows)


def numbers(text):
    return [float(word) for word in text.split()]


class Viewer:
    """Robots as a viewer has them: from the description and joint states, and from the transforms."""

    def __init__(self):
        self.joints, self.positions, self.frames = {}, {}, {}

    def describe(self, text):
        for joint in ElementTree.fromstring(text).iter("joint"):
            self.joints[joint.find("child").get("link")] = joint

    def take(self, message):
        for transform in message.transforms:
            move, turn = transform.transform.translation, transform.transform.rotation
            x, y, z, w = turn.x, turn.y, turn.z, turn.w
            rows = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
            pose = Pose(rows, [move.x, move.y, move.z])
            self.frames[transform.child_frame_id] = (transform.header.frame_id, pose)

    def of_urdf(self, link):
        """Pose of a link in the laboratory, by the description and the joint states."""
        if link == "laboratory":
            return Pose()
        joint = self.joints[link]
        origin, kind = joint.find("origin"), joint.get("type")
        roll, pitch, yaw = numbers(origin.get("rpy"))
        turn = about((0, 0, 1), yaw).compose(about((0, 1, 0), pitch)).compose(about((1, 0, 0), roll))
        pose = self.of_urdf(joint.find("parent").get("link")).compose(Pose(turn.rows, numbers(origin.get("xyz"))))
        if kind == "fixed":
            return pose
        axis, position = numbers(joint.find("axis").get("xyz")), self.positions[joint.get("name")]
        if kind == "prismatic":
            return pose.compose(Pose(place=[part * position for part in axis]))
        return pose.compose(about(axis, position))

    def of_transforms(self, frame):
        """The same by the transforms."""
        if frame == "laboratory":
            return Pose()
        parent, pose = self.frames[frame]
        return self.of_transforms(parent).compose(pose)

    def compare(self):
        """Ends the program unless both put every link into the same place, and part A where robot 1 holds it."""
        for link in self.joints:
            apart = self.of_urdf(link).apart(self.of_transforms(link))
            if apart > 1e-9:
                sys.exit(f"read_mcap.py: {link}: {apart} between the URDF and the transforms")
        places = [self.of_urdf("robot_1_part").place, self.of_transforms("part_a").place]
        if max(abs(a - b) for a, b in zip(*places)) > 1e-9:
            sys.exit(f"read_mcap.py: part A by the URDF and by the transforms: {places}")
        names = {joint.get("name") for joint in self.joints.values()}
        check("joints without a position", [name for name in self.positions if name not in names], [])
        moving = {joint.get("name") for joint in self.joints.values() if joint.get("type") != "fixed"}
        check("joints that move", len(moving), 13)
        check("positions without a joint", moving - self.positions.keys(), set())


VIEWER = Viewer()


def check_message(topic, cycle, message):
    """Compares a message with the sample drive's cycle."""
    if topic.startswith("/emulated") and topic.endswith("states"):
        VIEWER.positions |= zip(message.name, message.position)
    elif topic == "/robot_description":
        VIEWER.describe(message.data)
    elif topic.startswith("/tf"):
        VIEWER.take(message)
        if topic == "/tf" and cycle % 100 == 0:
            VIEWER.compare()
    if "joint_" in topic:
        check_joints(topic, cycle, message)
    elif topic == "/ft/wrench":
        check("force z", message.wrench.force.z, 0.3)
        check("moment z", message.wrench.torque.z, -0.03)
        check("frame", message.header.frame_id, "part_a")
    elif topic == "/ft/wrench_raw":
        check("raw force z", message.wrench.force.z, 0.3 - 98.1)
    elif topic == "/tf":
        frames = [transform.child_frame_id for transform in message.transforms]
        check("frames", frames[:5], ["part_a", "part_b", "simulated_part_a", "simulated_part_b", "contact_frame"])
        check("frames of the axes", len(frames[5:]), 14)
        pose = message.transforms[1].transform
        check("part B", (pose.translation.x, pose.translation.z), (0.5, 0.25))
        turn = pose.rotation
        check("attitude", (turn.x, turn.y, turn.z, turn.w), (0.0, 0.6, 0.0, 0.8))
    elif topic == "/hil/cycle":
        check("cycle", message.cycle, cycle)
        check("time", message.time_ns, cycle * 1_000_000)
        stamp = message.header.stamp
        check("stamp", (stamp.sec, stamp.nanosec), (STARTED_S + cycle // 1000, cycle % 1000 * 1_000_000))
        check("order", (message.robot_1_order, message.emulated_1_order), (1, 2))
        check("count", message.ft_link_received, cycle * 7)
        check("cause", message.cause, 15 if cycle == CYCLES - 1 else 0)
        check("limits", message.robot_1_limits, 1 << 10 if cycle == CYCLES - 1 else 0)
        check("null", math.isnan(message.robot_1_asked_1_rad), True)


def main():
    counts = Counter()
    with open(sys.argv[1], "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        check("profile", reader.get_header().profile, "ros2")
        names = [attachment.name for attachment in reader.iter_attachments()]
        check("attachments", names, ["campaign.toml"])
        provenance = [record.metadata for record in reader.iter_metadata() if record.name == "softdock"]
        check("provenance", provenance, [{"version": "0.1.0"}])
        for decoded in reader.iter_decoded_messages():
            topic = decoded.channel.topic
            check(f"schema of {topic}", decoded.schema.name, SCHEMAS[topic.rsplit("/", 1)[-1]])
            check_message(topic, decoded.message.sequence, decoded.decoded_message)
            counts[topic] += 1
    check("messages", dict(counts), EXPECTED)
    print(f"{sys.argv[1]}: {sum(counts.values())} messages on {len(counts)} topics decoded as expected")


if __name__ == "__main__":
    main()
