#!/usr/bin/env bash
# The check: format, lints, documentation, tests, and a campaign from file to verdict whose results other programs read.
# Installs on Debian what is missing; what cannot be had stops it.
#
#   bash tests/run.sh          the short check: slow tests at a small size (CONTRIBUTING.md lists them)
#   bash tests/run.sh --full   the long check: every test at its full size, parity on a second Vulkan driver as well
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

full=no
case "${1:-}" in
    "") ;;
    --full) full=yes ;;
    *)
        printf 'tests/run.sh: unknown argument %s; usage: bash tests/run.sh [--full]\n' "$1" >&2
        exit 2
        ;;
esac
target=${CARGO_TARGET_DIR:-target}
started=$SECONDS
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

step() { printf '\n== %s (after %s s)\n' "$*" "$((SECONDS - started))"; }

fail() {
    printf 'tests/run.sh: %s\n' "$*" >&2
    exit 1
}

# Installs Debian packages, as root or with sudo.
install() {
    command -v apt-get >/dev/null || fail "needs $* and there is no apt-get: install them by hand"
    local root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "needs $*: run 'apt-get install $*' as root"
        root=(sudo)
    fi
    "${root[@]}" apt-get update -qq
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

has_vulkan_loader() { find /usr/lib /lib /usr/local/lib -name 'libvulkan.so.1' 2>/dev/null | grep -q .; }
has_lavapipe() { find /usr/share/vulkan/icd.d /etc/vulkan/icd.d -name 'lvp_icd*.json' 2>/dev/null | grep -q .; }
has_venv() { command -v python3 >/dev/null && python3 -c 'import ensurepip, venv' 2>/dev/null; }

step "what the tests need"
command -v cargo >/dev/null || fail "needs Rust: https://rustup.rs"
missing=()
command -v cc >/dev/null || missing+=(gcc libc6-dev)
has_vulkan_loader || missing+=(libvulkan1)
has_lavapipe || missing+=(mesa-vulkan-drivers)
has_venv || missing+=(python3 python3-venv)
command -v ip >/dev/null || missing+=(iproute2)
command -v chromium >/dev/null || missing+=(chromium)
command -v firefox-esr >/dev/null || missing+=(firefox-esr libgl1-mesa-dri)
command -v Xvfb >/dev/null || missing+=(xvfb)
if [ "${#missing[@]}" -gt 0 ]; then
    echo "installing ${missing[*]}"
    install "${missing[@]}"
fi
has_vulkan_loader && has_lavapipe || fail "no Vulkan loader or no lavapipe after installing them"

# Three Python environments, made while the lints are compiled: the package and readers of results, peers of the protocols, and the
# driver of browsers.
python="$(realpath -m "$target")/venv/bin/python3"
peers="$(realpath -m "$target")/peers"
browsers="$(realpath -m "$target")/browsers"
make_environments() {
    if ! cmp -s tests/requirements.txt "$target/venv/made.txt"; then
        python3 -m venv --clear "$target/venv"
        "$python" -m pip install --quiet --disable-pip-version-check -r tests/requirements.txt
        cp tests/requirements.txt "$target/venv/made.txt"
    fi
    [ -f "$peers/ready" ] || host/realtime/tests/peers/install.sh "$peers"
    touch "$peers/ready"
    if ! cmp -s tests/browser/requirements.txt "$browsers/made.txt"; then
        python3 -m venv "$browsers"
        "$browsers/bin/python3" -m pip install --quiet --disable-pip-version-check -r tests/browser/requirements.txt
        cp tests/browser/requirements.txt "$browsers/made.txt"
    fi
}
mkdir -p "$target"
make_environments >"$scratch/environments.log" 2>&1 &
environments=$!

# The software driver writes nothing outside the scratch folder, and compiles a kernel that several tests run once.
export MESA_SHADER_CACHE_DIR="$scratch/shaders"
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    export XDG_RUNTIME_DIR="$scratch/runtime"
    mkdir -m 700 "$XDG_RUNTIME_DIR"
fi

# A second, independent driver, kept under the target folder: nothing is installed for it.
swiftshader="$(realpath -m "$target")/swiftshader"
fetch_swiftshader() {
    [ -f "$swiftshader/icd.json" ] && return
    mkdir -p "$swiftshader/package"
    (cd "$swiftshader" && apt-get download -qq chromium-common) || return
    dpkg -x "$swiftshader"/chromium-common_*.deb "$swiftshader/package" || return
    rm "$swiftshader"/chromium-common_*.deb
    local library
    library=$(find "$swiftshader/package" -name libvk_swiftshader.so | head -n 1)
    [ -n "$library" ] || return
    mv "$library" "$swiftshader/"
    rm -r "$swiftshader/package"
    printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.1.0"}}\n' \
        "$swiftshader/libvk_swiftshader.so" >"$swiftshader/icd.json"
}

if [ "$full" = yes ]; then
    export SOFTDOCK_FULL=1
    echo "the long check: every test at its full size, and parity on SwiftShader; about 11 minutes more than the short one"
fi

# One test more at a time than there are cores: some of them wait.
export RUST_TEST_THREADS=$(($(nproc) + 1))

# Rapier has other features: together they would rebuild the dependencies of the program.
all=(--release --workspace --exclude softdock-oracle-rapier)

step "format"
cargo fmt --all --check

step "lints"
cargo clippy --release --workspace --all-targets -- -D warnings

step "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --quiet

step "the book, and the links of every page"
bash docs/check.sh | tee "$scratch/docs.log"

wait "$environments" || {
    cat "$scratch/environments.log" >&2
    fail "the Python environments could not be made"
}
"$python" -c 'import duckdb, pyarrow; print("duckdb", duckdb.__version__, " pyarrow", pyarrow.__version__)'

step "tests"
cargo test "${all[@]}" --no-fail-fast
cargo test --release -p softdock-oracle-rapier

# An array job on a real Slurm cluster; it waits most of the time, and the next step computes meanwhile.
slurm=
slurm_missing="needs root"
if [ "$(id -u)" -eq 0 ]; then
    slurm_missing="Slurm could not be installed, or does not start here"
    for program in slurmctld slurmd sbatch munged pgrep; do
        command -v "$program" >/dev/null || { install slurmctld slurmd slurm-client munge procps; break; }
    done
    if bash tests/slurm/cluster.sh start "$scratch/slurm" >"$scratch/slurm.log" 2>&1; then
        slurm_missing=
        cargo test "${all[@]}" --test softdock slurm -- --ignored >"$scratch/slurm.log" 2>&1 &
        slurm=$!
    fi
    bash tests/slurm/cluster.sh stop "$scratch/slurm"
fi
[ "$full" = no ] || [ -z "$slurm_missing" ] || fail "Slurm: $slurm_missing: $(cat "$scratch/slurm.log")"

step "measured data of third parties"
data="${SOFTDOCK_DATA:-../shared/data}"
data_seen=no
long=()
[ "$full" = yes ] || long=(--skip second_encoders_of_a_robot)
if [ -d "$data/emps" ]; then
    SOFTDOCK_DATA="$(realpath "$data")" \
        cargo test "${all[@]}" --test diagnose measured -- --ignored --skip free_run_errors_of_the_cube "${long[@]}"
    [ "$full" = no ] || SOFTDOCK_DATA="$(realpath "$data")" \
        cargo test --release -p softdock-oracle-rapier --test tosses -- --ignored
    data_seen=yes
fi

if [ -n "$slurm" ]; then
    step "an array job on a Slurm cluster on loopback"
    wait "$slurm" || {
        cat "$scratch/slurm.log" >&2
        fail "the array job"
    }
    tail -n 3 "$scratch/slurm.log"
fi

advisories_seen=no
if [ "$full" = yes ]; then
    step "licences, sources and duplicate versions of dependencies"
    [ -x "$target/tools/bin/cargo-deny" ] ||
        CARGO_PROFILE_RELEASE_OPT_LEVEL=0 cargo install --quiet cargo-deny --locked --root "$target/tools"
    # Advisories too where their database can be fetched.
    "$target/tools/bin/cargo-deny" check licenses bans sources
    if "$target/tools/bin/cargo-deny" fetch db 2>"$scratch/advisories.log"; then
        "$target/tools/bin/cargo-deny" check --disable-fetch advisories
        advisories_seen=yes
    fi

    step "results page and server with a million runs"
    cargo test "${all[@]}" --test report --test softdock -- --ignored --nocapture million

    step "results in an object store"
    bash tests/store.sh "$target/s3" cargo test --release --features s3 --test store -- --ignored
fi

swiftshader_seen=no
if [ "$full" = yes ]; then
    step "parity, a second time, on SwiftShader"
    if fetch_swiftshader; then
        # The old name of the variable is for Vulkan loaders before 1.3.207.
        VK_DRIVER_FILES="$swiftshader/icd.json" VK_ICD_FILENAMES="$swiftshader/icd.json" \
            cargo test "${all[@]}" --test softdock parity
        swiftshader_seen=yes
    fi
fi

# The whole workspace, so that nothing is built again with other features.
step "third-party programs: Net F/T, FANUC, EGM and MCAP"
real_peers=()
[ -n "${SOFTDOCK_PEER_RSI:-}" ] || real_peers=(--skip running_controller_is_held)
SOFTDOCK_PEER_PYTHON="$peers/bin/python" cargo test "${all[@]}" --test peers -- --ignored "${real_peers[@]}"
SOFTDOCK_MCAP="$scratch/others.mcap" cargo test "${all[@]}" --lib write_a_log_for_others -- --ignored
"$peers/bin/python" host/realtime/tests/peers/read_mcap.py "$scratch/others.mcap"

step "the operator's page, in a browser"
SOFTDOCK_BROWSER=chromium cargo test "${all[@]}" --test softdock operator_page -- --ignored

step "the results page, in Chromium and Firefox"
python3 tests/browser/inject.py campaigns "$scratch/injected"
"$target/release/softdock" run "$scratch/injected/probe_drogue.toml" --runs 300 --backend cpu --out "$scratch/page" >"$scratch/page.log" ||
    [ "$?" -eq 1 ] || { cat "$scratch/page.log" >&2; fail "the campaign of the results page"; }
"$browsers/bin/python3" tests/browser/report.py "$scratch/page" --chromium chromium --firefox firefox-esr

step "the other pages, with markup in every name"
every=()
[ "$full" = no ] || every=(--all)
"$browsers/bin/python3" tests/browser/pages.py "$(realpath "$target")/release/softdock" "$scratch/pages" "${every[@]}"

step "a campaign, from its file to its verdict"
"$target/release/softdock" run campaigns/smoke.toml --out "$scratch/smoke"

step "the same results, read by other programs"
"$python" tests/read_results.py "$scratch/smoke"

step "shipped files and wrong values, as an editor checks them"
"$python" tests/schemas.py "$target/venv/bin/taplo"

step "exported scenes and runs, in MuJoCo and as ROS 2 messages"
"$python" tests/export.py "$target/release/softdock" "$scratch/export"

step "the Python package: its wheel, its tests, its notebooks"
(cd python && "$python" -m maturin build --quiet --profile release --strip --out "$scratch/wheels")
"$python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps "$scratch"/wheels/softdock-*.whl
(cd python && "$python" -m pytest -q -p no:cacheprovider)
# Whether the source distribution is whole: pip builds from it in an empty folder.
(cd python && "$python" -m maturin sdist --out "$scratch/source" >/dev/null 2>&1)
tar -xzf "$scratch"/source/softdock-*.tar.gz -C "$scratch/source"
(cd "$scratch"/source/softdock-*/ && cargo metadata --offline --format-version 1 >"$scratch/metadata.json")

if [ "$full" = no ]; then
    printf '\n!! NOT RUN: full sizes of slow tests, an object store, parity on SwiftShader: bash tests/run.sh --full\n' >&2
elif [ "$advisories_seen" = no ]; then
    printf '\n!! NOT RUN: advisories: their database could not be fetched\n' >&2
fi
if [ "$full" = yes ] && [ "$swiftshader_seen" = no ]; then
    printf '\n!! NOT RUN: parity on SwiftShader: Debian package chromium-common could not be fetched\n' >&2
fi
grep -F 'NOT RUN' "$scratch/docs.log" >&2 || true
[ "$data_seen" = yes ] ||
    printf '\n!! NOT RUN: diagnosis of measured data: give its folder as SOFTDOCK_DATA\n' >&2
[ -z "$slurm_missing" ] || printf '\n!! NOT RUN: an array job on a Slurm cluster: %s\n' "$slurm_missing" >&2
[ -n "${SOFTDOCK_PEER_RSI:-}" ] ||
    printf '\n!! NOT RUN: a running RSI controller: give the local address that it sends to as SOFTDOCK_PEER_RSI\n' >&2
[ -n "${SOFTDOCK_PEER_ETHERCAT:-}" ] ||
    printf '\n!! NOT RUN: a real EtherCAT segment: give its interface as SOFTDOCK_PEER_ETHERCAT\n' >&2
printf '\nall is well, after %s s\n' "$((SECONDS - started))"
