"""The client ABBRobotEGM against our emulated robot: egm_client.py CYCLES"""

import json
import sys

import numpy as np
from ABBRobotEGM import EGM

cycles = int(sys.argv[1])
with EGM(port=0) as client:
    print(json.dumps({"port": client.socket.getsockname()[1]}), flush=True)
    start, targets, missed, state, sequences = None, None, 0, None, []
    while len(sequences) < cycles:
        success, state = client.receive_from_robot(timeout=2.0)
        if not success:
            missed += 1
            if missed > 5:
                break
            continue
        if start is None:
            start = (np.array(state.joint_angles), np.array(state.external_axes))
        step = len(sequences)
        targets = (start[0] + 0.005 * step * np.arange(1, 7), start[1] + 0.01 * step)
        client.send_to_robot(targets[0], external_joints=targets[1])
        sequences.append(state.header.seqno)
    result = {
        "missed": missed,
        "first": sequences[0],
        "last": sequences[-1],
        "joints": list(state.joint_angles),
        "external": list(state.external_axes),
        "planned": list(state.joint_angles_planned),
        "position": list(state.cartesian.pos),
        "force": list(state.measured_force),
        "torque": list(state.torque_ref),
        "motors_on": state.motors_on,
        "rapid_running": state.rapid_running,
        "mci_state": int(state.mci_state),
        "target": list(targets[0]),
        "external_target": list(targets[1]),
    }
    print(json.dumps(result), flush=True)
