#!/usr/bin/env bash
# A run that is killed at random moments (kill -9) goes on and ends in the same files as one that is not.
#   resume.sh SCRATCH DYXEL KILLS
set -euo pipefail
out=$1
dyxel=$2
kills=${3:-10}
rm -rf "$out" && mkdir -p "$out"
# Quick settings: what is tested here is the path, not its quality.
quick=(--set actor.max_frames=4 --set actor.rounds=1 --set actor.refine=1 --set motion.max_iterations=8
  --set atlas.size=256 --set atlas.packing_trials=200 --quiet)
"$dyxel" studio "$out/capture" --preset tiny --quiet

start=$(date +%s%N)
"$dyxel" run "$out/capture" -o "$out/whole" "${quick[@]}"
length_ms=$((($(date +%s%N) - start) / 1000000))
echo "a whole run takes $length_ms ms"

RANDOM=7
for ((i = 0; i < kills; i++)); do
  "$dyxel" run "$out/capture" -o "$out/killed" "${quick[@]}" &
  pid=$!
  # Each life gets up to a quarter of the whole, so that the kills spread over its length.
  ms=$((RANDOM % (length_ms / 4 + 1)))
  sleep "$(printf '%d.%03d' $((ms / 1000)) $((ms % 1000)))"
  kill -9 $pid 2>/dev/null || true
  wait $pid 2>/dev/null || true
done
"$dyxel" run "$out/capture" -o "$out/killed" "${quick[@]}"
# Temporary files of killed writers may stay behind; they are hidden and named .part.
diff -rq --exclude=report --exclude='*.mp4' --exclude='.*.part*' "$out/whole" "$out/killed"
