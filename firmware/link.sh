#!/bin/sh
# Links an image of a board. The linker looks for memory.x in the folder that it stands in before any other, and the one
# at the top of the repository is that of the default board: so it stands in an empty folder instead.
# The linker is rust-lld of the toolchain that rustup has, or lld of the system.
set -eu
lld=""
for candidate in "$(rustup run stable rustc --print sysroot 2>/dev/null)" "$(rustc --print sysroot 2>/dev/null)"; do
    for found in "$candidate"/lib/rustlib/*/bin/rust-lld; do
        [ -x "$found" ] && lld=$found
    done
done
[ -n "$lld" ] || lld=$(command -v rust-lld || command -v ld.lld || true)
if [ -z "$lld" ]; then
    echo "neither rust-lld nor lld is installed" >&2
    exit 1
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cd "$folder"
case $lld in
*ld.lld) "$lld" "$@" ;;
*) "$lld" -flavor gnu "$@" ;;
esac
