#!/usr/bin/env bash
# Runs the program as a user would, on the shipped map and on real maps, and looks at what it writes.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$PWD/target/release/q3rays
[ -x "$program" ] || cargo build --release
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
passed=0

fail() {
    echo "smoke: $*" >&2
    exit 1
}

# A PNG of plausible size that is not one colour: black or blank images compress to almost nothing.
check_picture() {
    [ -s "$1" ] || fail "$1 was not written"
    [ "$(stat -c %s "$1")" -gt "$2" ] || fail "$1 looks empty ($(stat -c %s "$1") bytes)"
    passed=$((passed + 1))
}

cd "$out"
for map in showcase oa_dm1 am_galmevish2 oa_minia; do
    for backend in cpu bvh rayquery; do
        "$program" render "$map" --backend "$backend" --size 160x90 --spp 2 --out "$map-$backend.png" 2>log ||
            { cat log >&2; fail "render $map with $backend failed"; }
        check_picture "$map-$backend.png" 2000
    done
done
"$program" maps | grep -q '^oa_dm1 ' || fail "maps does not list oa_dm1"
"$program" info oa_dm1 --json | grep -q '"clusters": 422' || fail "info oa_dm1 is wrong"
passed=$((passed + 2))
echo "$passed passed, 0 failed"
