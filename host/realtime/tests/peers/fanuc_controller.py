"""airo-fanuc's strict fake controller, for our driver: fanuc_controller.py VERSION [estop|teach|state|program]"""

import json
import sys

from airo_fanuc.testing import FakeCRXConfig, FakeCRXController

START = [5.0, -30.0, 20.0, 0.0, -40.0, 10.0, 0.0, 0.0, 0.0]

config = FakeCRXConfig(strict=True, available_version=int(sys.argv[1]))
trouble = sys.argv[2] if len(sys.argv) > 2 else None
with FakeCRXController(config, initial_q_deg=START) as controller:
    if trouble == "estop":
        controller.press_estop()
    elif trouble == "teach":
        controller.set_teach(True)
    elif trouble == "state":
        controller.arm_rmi_error("FRC_Initialize", 2556943, times=2)
    elif trouble == "program":
        # The call is dropped without a word: the program never runs.
        controller.rmi._handle_call = lambda request: None
    controller.start_realtime()
    print(json.dumps({"stream": controller.sm_port, "rmi": controller.rmi_port}), flush=True)
    sys.stdin.readline()
    controller.stop_realtime()
    result = {
        "violations": controller.violations,
        "error": repr(controller.sm.realtime_error) if controller.sm.realtime_error else None,
        "alarms": controller.state.alarm_texts,
        "joints": list(controller.q_meas_deg),
    }
    print(json.dumps(result), flush=True)
