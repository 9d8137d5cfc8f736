#!/usr/bin/env bash
# Builds the Debian package target/debian/softdock_*.deb, with completions and manual pages. Needs cargo-deb.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
cargo build --locked --profile dist
program=target/dist/softdock
mkdir -p target/package/man
"$program" man target/package/man
gzip -9 -n -f target/package/man/*.1
for shell in bash zsh fish; do
    "$program" completions "$shell" >"target/package/softdock.$shell"
done
cargo deb --no-build --profile dist
