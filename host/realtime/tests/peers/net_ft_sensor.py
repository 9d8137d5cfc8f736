"""pynetft's fake sensor, for our driver: two streams with a lost record, garbage, an error, and a unit that is not SI."""

import json
import sys

from fake_sensor import FakeSensor

with FakeSensor() as sensor:
    sensor.configure(product_name="Gamma", counts_per_force=1_000_000, counts_per_torque=1_000, force_unit="lbf", torque_unit="N-mm")
    for step in range(1, 6):
        sensor.queue_record((step * 1_000_000, 0, -2_000_000, 0, 30_000, 0))
    sensor.queue_malformed()
    sensor.queue_record((4_000_000, 0, -2_000_000, 0, 30_000, 0), rdt_sequence=8, ft_sequence=8, status=0x80020000)
    sensor.queue_record((7_000_000, 0, 0, 0, 0, 0), rdt_sequence=9, ft_sequence=9, on_start=2)
    print(json.dumps({"rdt": sensor.rdt_port, "http": sensor.http_port}), flush=True)
    sys.stdin.readline()
    print(json.dumps({"requests": sensor.requests, "http_requests": sensor.http_request_count}), flush=True)
