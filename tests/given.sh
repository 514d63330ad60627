#!/usr/bin/env bash
# Given surfaces instead of a body, and a fit to another sequence.
#   given.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$out/given" "$out/given-report"
"$dyxel" run "$out/capture" -o "$out/given" --geometry "$out/capture/truth/meshes" --smooth-normals 10 \
  --set atlas.size=256 --quiet
node "$here/validate/validate.js" "$out/given/video/dss.glb"
"$dyxel" evaluate "$out/given" --truth "$out/capture/truth" --fit res_b -o "$out/given-report" --quiet
grep -q '"fit.res_b.relight.val_a.psnr_inside"' "$out/given-report/metrics.json"
