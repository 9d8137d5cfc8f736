"""Exported scenes and runs, read by MuJoCo and by a reader of ROS 2 messages.

usage: export.py SOFTDOCK FOLDER
"""

import json
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy
import pyarrow.parquet
from mcap_ros2.reader import read_ros2_messages

CAMPAIGNS = Path(__file__).parents[1] / "campaigns"
SCENES = ("probe_drogue", "berth", "insert", "soft_capture", "smoke_joint", "mesh")


def softdock(program: str, *arguments: object) -> dict:
    done = subprocess.run([program, *map(str, arguments), "--json"], capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


def near(found: numpy.ndarray, expected: numpy.ndarray, bound: float, what: str) -> None:
    error = numpy.abs(numpy.asarray(found) - expected).max()
    assert error <= bound, f"{what}: {error} is more than {bound}"


def pose(trace: dict, name: str, row: int) -> tuple[numpy.ndarray, numpy.ndarray]:
    place = numpy.array([trace[f"{name}_position_{axis}_m"][row] for axis in "xyz"])
    attitude = numpy.array([trace[f"{name}_attitude_{axis}"][row] for axis in "wxyz"])
    return place, attitude


def same_attitude(found: numpy.ndarray, expected: numpy.ndarray, bound: float, what: str) -> None:
    near(found * numpy.sign(found @ expected), expected, bound, what)


def scene(program: str, folder: Path, campaign: str) -> mujoco.MjModel:
    out = folder / campaign
    files = softdock(program, "export", "mjcf", CAMPAIGNS / f"{campaign}.toml", "--out", out)["files"]
    model = mujoco.MjModel.from_xml_path(files[0])
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_step(model, data)
    assert numpy.isfinite(data.qpos).all(), campaign
    return model


def replayed(program: str, model: mujoco.MjModel, results: Path, run: int) -> None:
    """Part A by MuJoCo's kinematics, from base and joints of the run, is where the relative position says."""
    history = softdock(program, "replay", results, run, "--out", results / "trace.parquet")
    trace = pyarrow.parquet.read_table(results / "trace.parquet").to_pydict()
    data = mujoco.MjData(model)
    joints = [name for name in trace if name.startswith("space_joint_")]
    for row in range(0, len(trace["t_s"]), max(1, len(trace["t_s"]) // 40)):
        for loop in ("space", "hil"):
            place, attitude = pose(trace, f"{loop}_base", row)
            data.joint("base_joint").qpos = numpy.concatenate([place, attitude])
            for name in joints:
                number = name.split("_")[2]
                data.joint(f"link_{number}_joint").qpos = trace[name.replace("space", loop, 1)][row]
            mujoco.mj_kinematics(model, data)
            part_b, _ = pose(trace, f"{loop}_part_b", row)
            relative = [trace[f"{loop}_relative_position_{axis}_m"][row] for axis in "xyz"]
            near(data.body("part_a").xpos - part_b, relative, 1e-9, f"run {run}, {loop}, row {row}")
    assert history is not None and len(joints) >= 6


def recorded(program: str, results: Path, run: int) -> None:
    """The recording has the numbers of the time history."""
    file = results / "run.mcap"
    softdock(program, "export", "mcap", results, run, "--out", file, "--start", 1_800_000_000)
    trace = pyarrow.parquet.read_table(results / "trace.parquet").to_pydict()
    kept = results / "traces" / f"run={run:09}.parquet"
    if kept.is_file():
        trace = pyarrow.parquet.read_table(kept).to_pydict()
    row = len(trace["t_s"]) // 2
    stamp = 1_800_000_000_000_000_000 + round(trace["t_s"][row] * 1e9)
    times: dict[str, int] = {}
    seen = set()
    for message in read_ros2_messages(str(file)):
        topic, time = message.channel.topic, message.log_time_ns
        assert time >= times.get(topic, 0), topic
        times[topic] = time
        if topic == "/robot_description":
            assert "<robot" in message.ros_msg.data
            seen.add(topic)
        if time != stamp:
            continue
        seen.add(topic)
        if topic == "/tf":
            frames = {frame.child_frame_id: frame.transform for frame in message.ros_msg.transforms}
            for loop in ("space", "hil"):
                base = frames[f"{loop}/base"]
                place, attitude = pose(trace, f"{loop}_base", row)
                near(numpy.array([getattr(base.translation, axis) for axis in "xyz"]), place, 0.0, "base")
                same_attitude(numpy.array([getattr(base.rotation, axis) for axis in "wxyz"]), attitude, 0.0, "base")
        if topic == "/hil/measured_wrench":
            force = [getattr(message.ros_msg.wrench.force, axis) for axis in "xyz"]
            near(numpy.array(force), [trace[f"measured_force_{axis}_n"][row] for axis in "xyz"], 0.0, topic)
            assert message.ros_msg.header.stamp.sec == stamp // 1_000_000_000
            assert message.ros_msg.header.frame_id == "hil/part_a"
        if topic == "/space/joint_states":
            angles = [trace[f"space_joint_{number}_rad"][row] for number in range(1, len(message.ros_msg.name) + 1)]
            near(numpy.array(message.ros_msg.position), angles, 0.0, topic)
        if topic == "/signals":
            assert message.ros_msg.hil_injected_energy_j == trace["hil_injected_energy_j"][row]
    wanted = {"/tf", "/robot_description", "/space/joint_states", "/space/contact_wrench", "/hil/measured_wrench", "/signals"}
    assert wanted <= seen, wanted - seen


def main() -> None:
    program, folder = sys.argv[1], Path(sys.argv[2])
    models = {campaign: scene(program, folder, campaign) for campaign in SCENES}
    results = folder / "results"
    softdock(program, "run", CAMPAIGNS / "probe_drogue.toml", "--runs", 24, "--backend", "cpu", "--out", results)
    kept = sorted(int(path.stem.split("=")[1]) for path in (results / "traces").glob("run=*.parquet"))
    for run in (kept[0], next(run for run in range(24) if run not in kept)):
        replayed(program, models["probe_drogue"], results, run)
        recorded(program, results, run)
    print(f"{len(models)} scenes in MuJoCo {mujoco.__version__}; part A of two runs within 1e-9 m; recordings equal to the bit")


main()
