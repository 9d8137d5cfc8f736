#!/bin/sh
# Installs the program of a release into ~/.local/bin, with completions and manual pages:
#
#   curl -fsSL REPOSITORY/releases/latest/download/install.sh | sh
#
# The release workflow puts the address of the repository in the place of REPOSITORY.
set -eu

base="${SOFTDOCK_RELEASES:-REPOSITORY/releases/latest/download}"
prefix="${SOFTDOCK_PREFIX:-$HOME/.local}"

fail() {
    printf 'install.sh: %s\n' "$*" >&2
    exit 1
}

case "$(uname -s)-$(uname -m)" in
    Linux-x86_64) name=linux-x86_64 ;;
    Linux-aarch64) name=linux-aarch64 ;;
    Darwin-arm64) name=macos-aarch64 ;;
    *) fail "no archive for $(uname -s) on $(uname -m); build it with cargo, or use pip install softdock" ;;
esac
archive="softdock-$name.tar.gz"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
for file in "$archive" "$archive.sha256"; do
    curl -fsSL "$base/$file" -o "$scratch/$file" || fail "could not fetch $base/$file"
done
if command -v sha256sum >/dev/null; then check="sha256sum -c"; else check="shasum -a 256 -c"; fi
(cd "$scratch" && $check "$archive.sha256" >/dev/null) || fail "$archive is damaged: its hash is not the stated one"
tar -xzf "$scratch/$archive" -C "$scratch"
mkdir -p "$prefix/bin" "$prefix/share/man/man1" "$prefix/share/bash-completion/completions"
install -m 755 "$scratch/softdock-$name/softdock" "$prefix/bin/softdock"
cp "$scratch/softdock-$name"/man/*.1 "$prefix/share/man/man1/"
cp "$scratch/softdock-$name/completions/softdock.bash" "$prefix/share/bash-completion/completions/softdock"
"$prefix/bin/softdock" --version
case ":$PATH:" in
    *":$prefix/bin:"*) ;;
    *) printf 'add %s to PATH\n' "$prefix/bin" ;;
esac
