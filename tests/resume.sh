#!/usr/bin/env bash
# A run that is killed at random moments (kill -9) goes on and ends in the same files as one that is not.
#   resume.sh SCRATCH DYXEL KILLS
set -euo pipefail
out=$1
dyxel=$2
kills=${3:-10}
. "$(dirname "$0")/quick.sh"
rm -rf "$out/killed"
# Milliseconds that the whole run took (run.sh).
length_ms=$(awk -F: '/"wall_s"/ {s += $2} END {printf "%d", 1000 * s}' "$out/two/report/timings.json")
RANDOM=7
for ((i = 0; i < kills; i++)); do
  "$dyxel" run "$out/capture" -o "$out/killed" "${quick[@]}" &
  pid=$!
  # So long a life that the kills spread over the run's length.
  ms=$((RANDOM % (2 * length_ms / kills + 1)))
  sleep "$(printf '%d.%03d' $((ms / 1000)) $((ms % 1000)))"
  kill -9 $pid 2>/dev/null || true
  wait $pid 2>/dev/null || true
done
"$dyxel" run "$out/capture" -o "$out/killed" "${quick[@]}"
same "$out/two" "$out/killed"
