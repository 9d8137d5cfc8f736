#!/usr/bin/env bash
# Runs a command with a local S3 server (moto, from PyPI) and its bucket `runs`.
#
#   bash tests/store.sh VENV COMMAND...
set -euo pipefail
venv=$1
shift
if ! "$venv/bin/python3" -c 'import moto.server, boto3' 2>/dev/null; then
    python3 -m venv "$venv"
    "$venv/bin/python3" -m pip install --quiet --disable-pip-version-check 'moto[server,s3]' boto3
fi
port=$("$venv/bin/python3" -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
"$venv/bin/moto_server" -H 127.0.0.1 -p "$port" >/dev/null 2>&1 &
server=$!
trap 'kill $server' EXIT
export AWS_ENDPOINT_URL="http://127.0.0.1:$port" AWS_ALLOW_HTTP=true AWS_REGION=us-east-1
export AWS_ACCESS_KEY_ID=test AWS_SECRET_ACCESS_KEY=test
"$venv/bin/python3" - <<'PY'
import time, boto3, os
client = boto3.client("s3", endpoint_url=os.environ["AWS_ENDPOINT_URL"])
for attempt in range(100):
    try:
        client.create_bucket(Bucket="runs")
        break
    except Exception:
        if attempt == 99:
            raise
        time.sleep(0.2)
PY
"$@"
