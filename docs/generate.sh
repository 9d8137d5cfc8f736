#!/usr/bin/env bash
# Writes the generated pages of docs/reference and the schemas of campaigns/schemas from the program; a test compares them
# (tests/docs.rs).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
SOFTDOCK_WRITE_DOCS=1 cargo test --release --test softdock docs::
