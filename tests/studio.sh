#!/usr/bin/env bash
# The studio's smallest capture, which the other whole-program tests use, and its check.
#   studio.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
rm -rf "$out" && mkdir -p "$out"
"$dyxel" studio "$out/capture" --preset tiny --quiet
"$dyxel" check "$out/capture" >"$out/check.txt"
grep -q cam0 "$out/check.txt"
