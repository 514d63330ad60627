#!/usr/bin/env bash
# A run with two threads, and again: nothing is done twice.
#   run.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
. "$(dirname "$0")/quick.sh"
rm -rf "$out/two"
"$dyxel" run "$out/capture" -o "$out/two" --jobs 2 "${quick[@]}"
test -s "$out/two/report/timings.json" && test -s "$out/two/video/dss.glb"
touch "$out/before"
"$dyxel" run "$out/capture" -o "$out/two" "${quick[@]}"
test -z "$(find "$out/two" -type f -newer "$out/before")"
