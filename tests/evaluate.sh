#!/usr/bin/env bash
# Every figure of a project against its truth, pictures from project and video, and the Khronos validator.
#   evaluate.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
here=$(cd "$(dirname "$0")" && pwd)
test -d "$here/validate/node_modules/gltf-validator" || {
  echo "the glTF validator is missing: run scripts/setup --tests" >&2
  exit 1
}
rm -rf "$out/report"
"$dyxel" evaluate "$out/two" --truth "$out/capture/truth" -o "$out/report" --quiet
for key in silhouette.dss.iou tracking.res.iou tracking.dss.surface_mm tracking.dss.flow_px atlas.I.flips \
  atlas.II.overlap recorded.dss.psnr holdout.dss.psnr_inside relight.val_a.psnr_inside \
  albedo.res.albedo_psnr normals.dss.normal_deg normals.dss.flicker_deg coverage.texels video.bytes; do
  grep -q "\"$key\"" "$out/report/metrics.json" || { echo "no $key in metrics.json" >&2; exit 1; }
done
test -s "$out/report/index.html"
"$dyxel" render "$out/two" --sequence dss --frame 1 --camera cam0 --lights rig -o "$out/project.png" --quiet
"$dyxel" render "$out/two/video/dss.glb" --orbit --frame 1 -o "$out/orbit.png" --quiet
test -s "$out/project.png" && test -s "$out/orbit.png"
node "$here/validate/validate.js" "$out/two/actor/actor.glb" "$out/two/video/dss.glb"
