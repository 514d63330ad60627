// The renderer on the CPU (architecture.md): visibility buffer, deferred SIMD shading by the very
// BRDF functions of the fit, shadow maps. Deterministic; what `evaluate` uses.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dyxel/base/option.h"
#include "dyxel/capture/camera.h"
#include "dyxel/capture/light.h"
#include "dyxel/image/image.h"
#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/video/relightable_video.h"

namespace dyxel {

enum class Pass { kBeauty, kNormal, kDiffuse, kSpecular, kDepth, kMaterial, kUv, kConfidence };
[[nodiscard]] Pass ParsePass(const std::string& name);  // throws Error(kUsage) listing them

struct RenderOptions {
  int samples = 2;
  int shadow_size = 2048;
  int environment_lights = 64;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.samples,
          {.name = "samples",
           .min = 1,
           .max = 8,
           .help = "samples a pixel along each side (anti-aliasing)"});
    field(o.shadow_size,
          {.name = "shadow_size",
           .unit = "px",
           .min = 64,
           .max = 16384,
           .help = "side of a shadow map"});
    field(o.environment_lights,
          {.name = "environment_lights",
           .min = 1,
           .max = 4096,
           .help = "directional lights that an environment is sampled as"});
  }
};

// What is shown: one posed surface with its maps. The normal map is in the tangent frame.
struct RenderSurface {
  const Atlas* atlas = nullptr;
  const PosedSurface* surface = nullptr;
  const MaterialMaps* maps = nullptr;
  const ImageF* normal_map = nullptr;  // null: the model's normals
};

struct Lighting {
  std::vector<Light> lights;
  std::optional<Environment> environment;
};

// A picture [h][w][4]: linear radiance (or the pass's value) and coverage. Premultiplied. The
// normal pass holds world normals, the depth pass z along the camera's axis (both unpremultiplied
// averages over the covered samples).
[[nodiscard]] ImageF Render(const RenderSurface& surface,
                            const Camera& camera,
                            const Lighting& lighting,
                            Pass pass = Pass::kBeauty,
                            const RenderOptions& options = {});

// The environment as N directional lights by importance sampling (A §VII): equal-energy regions of
// the map (median cut), each with its mean direction; irradiance is the sum over the region.
[[nodiscard]] std::vector<Light> SampleEnvironment(const Environment& environment, int count);

}  // namespace dyxel
