#!/usr/bin/env bash
# The Khronos validator finds no error in the videos: a tracked body's and a given surface's.
#   gltf.sh SCRATCH DYXEL
set -euo pipefail
out=$1
dyxel=$2
here=$(cd "$(dirname "$0")" && pwd)
test -d "$here/validate/node_modules/gltf-validator" || {
  echo "the validator is missing: run scripts/setup --tests" >&2
  exit 1
}
rm -rf "$out" && mkdir -p "$out"
"$dyxel" studio "$out/capture" --preset tiny --quiet
"$dyxel" run "$out/capture" -o "$out/own" --quiet
"$dyxel" run "$out/capture" -o "$out/given" --geometry "$out/capture/truth/meshes" --smooth-normals 10 --quiet
node "$here/validate/validate.js" "$out/own/actor/actor.glb" "$out/own/video/dss.glb" "$out/given/video/dss.glb"
