#!/usr/bin/env bash
# Measures one graphics card with a carried program; needs a Vulkan driver, bash and nothing else. At most 9 minutes.
#
#   bash tests/gpu.sh [DIR]        writes DIR/card.json, DIR/parity.txt and, with NVIDIA's profiler, DIR/counters.csv
#                                  (DIR: results/cards/DATE-TIME)
#
#   SOFTDOCK        the program (target/release/softdock)
#   SOFTDOCK_TESTS  the test program (target/release/deps/softdock-*), for parity function by function; left out without it
#   SOFTDOCK_SMALL  1: a software driver in a minute, to try this script
#
# Exit codes: 0 the card may be used, 1 a fault is reported, 2 no card or no program.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
    printf 'tests/gpu.sh: %s\n' "$*" >&2
    exit 2
}

program=${SOFTDOCK:-target/release/softdock}
[ -x "$program" ] || fail "no program \`$program\`: carry it here, or build it: cargo build --release"
out=${1:-results/cards/$(date +%Y%m%d-%H%M%S)}
[ ! -e "$out" ] || fail "\`$out\` exists: name a new folder"
mkdir -p "$out"
started=$SECONDS
code=0

size=()
tests=(parity gpu)
if [ "${SOFTDOCK_SMALL:-}" = 1 ]; then
    size=(--software --quick --lanes "64,1024" --runs 256)
    tests=(gpu)
fi

printf '== the card (after %s s)\n' "$((SECONDS - started))"
"$program" devices

printf '\n== speed over lanes, loss of the device, a campaign by phases (after %s s)\n' "$((SECONDS - started))"
"$program" bench device campaigns/probe_drogue.toml --out "$out" ${size[@]+"${size[@]}"} || code=$?
[ "$code" -le 1 ] || exit "$code"
rm -r "$out/campaign"

printf '\n== parity, function by function (after %s s)\n' "$((SECONDS - started))"
if [ -n "${SOFTDOCK_TESTS:-}" ]; then
    # The test program reads campaigns from the folder that it was built in.
    timeout 240 "$SOFTDOCK_TESTS" "${tests[@]}" >"$out/parity.txt" 2>&1 || code=1
    grep -E '^test result|^test .*FAILED|panicked' "$out/parity.txt" || code=1
else
    echo "left out: SOFTDOCK_TESTS names no test program"
fi

printf '\n== registers and occupancy (after %s s)\n' "$((SECONDS - started))"
if command -v nvidia-smi >/dev/null; then
    nvidia-smi --query-gpu=name,driver_version,clocks.max.sm,power.limit --format=csv | tee "$out/clocks.csv"
fi
# NVIDIA's counters for Vulkan come from Nsight Graphics; without it the driver states registers in its shader statistics.
if command -v ngfx >/dev/null; then
    ngfx --activity "GPU Trace Profiler" --exe "$program" --args "bench --quick" --output-dir "$out/trace" --auto-export \
        --start-after-submits 50 --limit-to-submits 5 || echo "ngfx gave no trace"
else
    echo "left out: Nsight Graphics (ngfx) is not installed"
fi

printf '\n== %s s; %s\n' "$((SECONDS - started))" "$out/card.json"
exit "$code"
