#!/usr/bin/env bash
# What a person sees where it fails: one sentence and an exit status; nothing is computed first.
#   refusals.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
rm -rf "$out/refused" && mkdir -p "$out/refused"
cp -r "$out/capture" "$out/refused/capture"
expect() { # STATUS COMMAND…
  local wanted=$1 status=0
  shift
  "$@" >"$out/refused/out" 2>"$out/refused/err" || status=$?
  test "$status" = "$wanted" || { echo "$*: exit status $status, not $wanted" >&2; exit 1; }
}
expect 2 "$dyxel" run "$out/capture" -o "$out/refused/x" --set motion.nonsense=1
grep -q 'Did you mean' "$out/refused/err"
expect 3 "$dyxel" run "$out/nowhere" -o "$out/refused/x"
test "$(wc -l <"$out/refused/err")" -le 3
mv "$out/refused/capture/res/cam0/0000.exr" "$out/refused/aside.exr"
expect 3 "$dyxel" run "$out/refused/capture" -o "$out/refused/y"
grep -q 'res/cam0/{frame:04}.exr: 1 of 8 frames are missing' "$out/refused/err"
test ! -e "$out/refused/y/silhouettes"
