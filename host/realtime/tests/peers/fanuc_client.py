"""airo-fanuc's client against our emulated controller: fanuc_client.py STREAM_PORT RMI_PORT"""

import json
import sys

import numpy as np
from airo_fanuc import DriverConfig, DriverPolicy, FanucDriver, RobotProfile

profile = RobotProfile.from_degrees(
    name="softdock",
    model="emulated",
    velocity_limits_deg_s=[60.0] * 6,
    acceleration_limits_deg_s2=[200.0] * 6,
    jerk_limits_deg_s3=[1000.0] * 6,
    position_limits_lower_deg=[-170.0] * 6,
    position_limits_upper_deg=[170.0] * 6,
)
config = DriverConfig(profile=profile, sm_port=int(sys.argv[1]), rmi_port=int(sys.argv[2]))
policy = DriverPolicy(config=config, enable_gripper=False, enable_ownership=False, auto_recover=False)
driver = FanucDriver("127.0.0.1", policy)
try:
    start = np.array(driver.get_joint_configuration())
    result = driver.move_j(start + np.radians(5.0), joint_speed=0.2).wait(timeout=20.0)
    joints = np.degrees(driver.get_joint_configuration())
finally:
    driver.close()
print(json.dumps({"result": result.value, "joints": list(joints)}), flush=True)
