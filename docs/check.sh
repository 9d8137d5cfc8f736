#!/usr/bin/env bash
# Checks the links of all Markdown pages and builds the book with mdBook, which it installs into target/mdbook.
# Where mdBook cannot be installed, that part is NOT RUN; the links are checked all the same.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

version=0.4.52
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
mdbook="$target/mdbook/bin/mdbook"

python3 docs/check.py

if ! "$mdbook" --version 2>/dev/null | grep -qF "$version"; then
    log=$(mktemp)
    nice cargo install mdbook --locked --no-default-features --features search --version "$version" --root "$target/mdbook" >"$log" 2>&1 || {
        printf '!! NOT RUN: the book: mdBook %s could not be installed: %s\n' "$version" "$(tail -n 1 "$log")"
        rm -f "$log"
        exit 0
    }
    rm -f "$log"
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
"$mdbook" build docs --dest-dir "$target/book" >"$log" 2>&1 || {
    cat "$log" >&2
    exit 1
}
if grep -E 'WARN|ERROR' "$log"; then
    printf 'docs/check.sh: mdBook has warnings\n' >&2
    exit 1
fi
printf 'the book is in %s\n' "$target/book"
