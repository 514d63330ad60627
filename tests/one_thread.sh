#!/usr/bin/env bash
# One thread and two give the same files; an edited mask is kept, and what follows is done again.
#   one_thread.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
. "$(dirname "$0")/quick.sh"
rm -rf "$out/one"
"$dyxel" run "$out/capture" -o "$out/one" --jobs 1 "${quick[@]}"
same "$out/two" "$out/one"

mask=$(find "$out/one/silhouettes/res" -name '*.png' | sort | head -n 1)
other=$(find "$out/one/silhouettes/res" -name '*.png' | sort | sed -n 2p)
cp "$other" "$mask"
"$dyxel" status "$out/one" >"$out/status.txt"
grep -q "edited, and kept: ${mask#"$out/one/"}" "$out/status.txt"
"$dyxel" run "$out/capture" -o "$out/one" --until actor "${quick[@]}"
cmp "$other" "$mask"
! cmp -s "$out/one/actor/actor.glb" "$out/two/actor/actor.glb"
