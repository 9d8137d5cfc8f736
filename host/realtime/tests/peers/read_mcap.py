"""Reads a drive's MCAP log with mcap-ros2-support and compares it with the sample drive that the tests write.

Usage: read_mcap.py FILE, where FILE was written by
    SOFTDOCK_MCAP=FILE cargo test -p softdock-realtime write_a_log_for_others -- --ignored
Needs mcap-ros2-support from PyPI.
"""

import math
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

CYCLES = 2001
STARTED_S = 1_800_000_000
ROBOTS = ["robot_1", "robot_2", "emulated_1", "emulated_2"]
# A dry run: the real robots are told to hold, so that they have no commands.
EXPECTED = {f"/{robot}/joint_states": CYCLES for robot in ROBOTS}
EXPECTED |= {f"/{robot}/joint_commands": CYCLES for robot in ROBOTS[2:]}
EXPECTED |= {"/ft/wrench": CYCLES, "/ft/wrench_raw": CYCLES, "/tf": CYCLES, "/hil/cycle": CYCLES}
EXPECTED |= {"/robot_description": 1}
SCHEMAS = {
    "joint_states": "sensor_msgs/msg/JointState",
    "joint_commands": "sensor_msgs/msg/JointState",
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "wrench_raw": "geometry_msgs/msg/WrenchStamped",
    "tf": "tf2_msgs/msg/TFMessage",
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


def check_message(topic, cycle, message):
    """Compares a message with the sample drive's cycle."""
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
        check("frames", frames, ["part_a", "part_b", "simulated_part_a", "simulated_part_b"])
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
