#!/usr/bin/env bash
# Makes a Python environment with the third-party peers of the protocol tests: install.sh DIRECTORY
# Then: SOFTDOCK_PEER_PYTHON=DIRECTORY/bin/python cargo test --release -p softdock-realtime --test peers -- --ignored
set -euo pipefail

directory=${1:?usage: install.sh DIRECTORY}
python3 -m venv "$directory"
python=$directory/bin/python
"$python" -m pip install --quiet --disable-pip-version-check \
    pynetft==2.1.3 NetFT==2.0.1 airo-fanuc==0.1.0 ABBRobotEGM==1.0.7 mcap-ros2-support==0.6.0 pytest

# The fake sensor is in pynetft's source distribution only.
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$python" -m pip download --quiet --disable-pip-version-check --no-deps --no-binary pynetft \
    --dest "$scratch" pynetft==2.1.3
tar -xzf "$scratch"/pynetft-*.tar.gz -C "$scratch"
packages=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
cp "$scratch"/pynetft-*/tests/integration/fake_sensor.py "$packages"/
