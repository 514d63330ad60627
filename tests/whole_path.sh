#!/usr/bin/env bash
# The whole path on the studio's smallest capture: check, run, evaluate, render; the same files from
# one thread and from two; and what a person would see where it fails.
#   whole_path.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
here=$(cd "$(dirname "$0")" && pwd)
test -d "$here/validate/node_modules/gltf-validator" || {
  echo "the glTF validator is missing: run scripts/setup --tests" >&2
  exit 1
}
rm -rf "$out" && mkdir -p "$out"

# Quick settings: what is tested here is the path, not its quality.
quick=(--set actor.max_frames=4 --set actor.rounds=1 --set actor.refine=1 --set motion.max_iterations=8
  --set atlas.size=256 --set atlas.packing_trials=200 --quiet)

# Compares two projects but for what may differ: times, logs, the report, MP4s.
same() {
  diff -rq --exclude=report --exclude='*.mp4' "$1" "$2"
}

echo "--- studio and check"
"$dyxel" studio "$out/capture" --preset tiny --quiet
"$dyxel" check "$out/capture" >"$out/check.txt"
grep -q cam0 "$out/check.txt"

echo "--- run with two threads, and with one"
"$dyxel" run "$out/capture" -o "$out/two" --jobs 2 "${quick[@]}"
"$dyxel" run "$out/capture" -o "$out/one" --jobs 1 "${quick[@]}"
same "$out/two" "$out/one"
test -s "$out/two/report/timings.json"

echo "--- running again does nothing"
touch "$out/before"
"$dyxel" run "$out/capture" -o "$out/two" "${quick[@]}"
test -z "$(find "$out/two" -type f -newer "$out/before")"

echo "--- an edited mask is kept, and what follows is done again"
mask=$(find "$out/one/silhouettes" -name '*.png' | sort | head -n 1)
other=$(find "$out/one/silhouettes" -name '*.png' | sort | sed -n 2p)
cp "$other" "$mask"
"$dyxel" status "$out/one" >"$out/status.txt"
grep -q "edited, and kept: ${mask#"$out/one/"}" "$out/status.txt"
"$dyxel" run "$out/capture" -o "$out/one" --until actor "${quick[@]}"
cmp "$other" "$mask"
! cmp -s "$out/one/actor/actor.glb" "$out/two/actor/actor.glb"

echo "--- evaluate against the truth"
"$dyxel" evaluate "$out/two" --truth "$out/capture/truth" --fit res_b -o "$out/report" --quiet
for key in silhouette.dss.iou tracking.res.iou tracking.dss.surface_mm atlas.I.flips recorded.dss.psnr \
  holdout.dss.psnr_inside relight.val_a.psnr_inside fit.res_b.relight.val_a.psnr_inside \
  albedo.res.albedo_psnr normals.dss.normal_deg coverage.texels video.bytes; do
  grep -q "\"$key\"" "$out/report/metrics.json" || { echo "no $key in metrics.json" >&2; exit 1; }
done
test -s "$out/report/index.html"

echo "--- render from the project and from the file"
"$dyxel" render "$out/two" --sequence dss --frame 1 --camera cam0 --lights rig -o "$out/project.png" --quiet
"$dyxel" render "$out/two/video/dss.glb" --orbit --frame 1 -o "$out/orbit.png" --quiet
test -s "$out/project.png" && test -s "$out/orbit.png"

echo "--- given surfaces, and the Khronos validator on all videos"
"$dyxel" run "$out/capture" -o "$out/given" --geometry "$out/capture/truth/meshes" --smooth-normals 10 \
  --set atlas.size=256 --quiet
node "$here/validate/validate.js" "$out/two/actor/actor.glb" "$out/two/video/dss.glb" "$out/given/video/dss.glb"

echo "--- wrong usage and bad input"
status=0; "$dyxel" run "$out/capture" -o "$out/x" --set motion.nonsense=1 2>"$out/err" || status=$?
test "$status" = 2 && grep -q 'Did you mean' "$out/err"
status=0; "$dyxel" run "$out/nowhere" -o "$out/x" 2>"$out/err" || status=$?
test "$status" = 3
test "$(wc -l <"$out/err")" -le 3
mv "$out/capture/res/cam0/0000.exr" "$out/aside.exr"
status=0; "$dyxel" run "$out/capture" -o "$out/y" 2>"$out/err" || status=$?
test "$status" = 3 && grep -q 'res/cam0/0000.exr' "$out/err" && test ! -e "$out/y/silhouettes"
