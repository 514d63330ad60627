#!/usr/bin/env bash
# An include of a higher folder, or a higher folder in DEPENDS, fails when the build is configured.
set -euo pipefail
source=$(cd "$(dirname "$0")/layers" && pwd)
out=$1
rm -rf "$out" && mkdir -p "$out"
cmake -S "$source" -B "$out/good" >"$out/good.log" 2>&1
for mode in include depends; do
  if cmake -S "$source" -B "$out/$mode" -DMODE=$mode >"$out/$mode.log" 2>&1; then
    echo "mode $mode configured, and must not" >&2
    exit 1
  fi
done
grep -q 'includes dyxel/math: not in its DEPENDS' <(tr -s '\n ' ' ' <"$out/include.log")
grep -q 'which is not on a lower floor' <(tr -s '\n ' ' ' <"$out/depends.log")
