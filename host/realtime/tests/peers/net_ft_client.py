"""The clients pynetft and NetFT against our emulated box: net_ft_client.py pynetft|NetFT HOST RDT_PORT HTTP_PORT"""

import json
import sys
import time

kind, host, rdt_port, http_port = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])


def with_pynetft():
    from pynetft import Client, Config, RecoveryPolicy

    config = Config(sensor_host=host, rdt_port=rdt_port, http_port=http_port, recovery_policy=RecoveryPolicy.FAIL_STOP)
    with Client(config, queue_size=10_000) as client:
        stream = client.samples(timeout=2.0)
        begin = time.monotonic()
        samples = [next(stream) for _ in range(1000)]
        elapsed = time.monotonic() - begin
        client.bias()
        time.sleep(0.2)
        biased = client.latest_sample()
        health = client.health()
    return {
        "wrench": [*samples[-1].force, *samples[-1].torque],
        "units": [samples[-1].force_unit.value, samples[-1].torque_unit.value],
        "biased": [*biased.force, *biased.torque],
        "elapsed": elapsed,
        "lost": health.lost_count,
        "errors": health.device_error_count,
        "product": health.sensor_configuration.product_name,
    }


def with_netft():
    from NetFT import Sensor

    sensor = Sensor(host)
    single = sensor.getMeasurement()
    sensor.startStreaming(handler=False)
    streamed = [sensor.receive() for _ in range(1000)]
    sensor.stopStreaming()
    return {"single": single, "streamed": streamed[-1]}


print(json.dumps(with_pynetft() if kind == "pynetft" else with_netft()), flush=True)
