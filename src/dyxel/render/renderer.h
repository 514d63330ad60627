// The renderer on the CPU (architecture.md): visibility buffer, deferred SIMD shading by the very
// BRDF functions of the fit, shadow maps. Deterministic; what `evaluate` uses. docs/method.md, E.
#pragma once

#include <memory>
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
[[nodiscard]] const char* PassName(Pass pass);

struct RenderOptions {
  int samples = 2;
  int shadow_size = 2048;
  int environment_lights = 64;
  int environment_shadow_size = 512;

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
    field(o.environment_shadow_size,
          {.name = "environment_shadow_size",
           .unit = "px",
           .min = 64,
           .max = 16384,
           .help = "side of the shadow map of each of an environment's lights"});
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

// The lights of a scene with their shadow maps for one posed surface: computed once, used for any
// number of cameras and passes. An environment is sampled as directional lights first.
class PreparedLighting {
 public:
  PreparedLighting(const RenderSurface& surface,
                   const Lighting& lighting,
                   const RenderOptions& options = {});
  ~PreparedLighting();
  PreparedLighting(PreparedLighting&&) noexcept;
  PreparedLighting& operator=(PreparedLighting&&) noexcept;

  struct Data;
  [[nodiscard]] const Data& data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

// A picture [h][w][4] each pass: the pass's value and coverage in [0, 1], deterministic, parallel
// over tiles. A surface seen from behind is shaded as if it had two sides.
//   beauty      linear radiance, premultiplied
//   diffuse     diffuse albedo, premultiplied
//   specular    the first three specular parameters, premultiplied
//   confidence  in all three channels, premultiplied
//   normal      world normal (unit), mean over the covered samples
//   depth       metres along the camera's axis in all three channels, mean over the covered samples
//   material    index into the materials in all three channels, of the first covered sample
//   uv          parameterization I (u, v, 0), of the first covered sample
// Throws Error(kUsage) where the surface's maps have other sizes than its atlas.
[[nodiscard]] std::vector<ImageF> RenderPasses(const RenderSurface& surface,
                                               const Camera& camera,
                                               const PreparedLighting& lighting,
                                               std::span<const Pass> passes,
                                               const RenderOptions& options = {});

// One pass of one camera: the same with the lighting prepared for it alone.
[[nodiscard]] ImageF Render(const RenderSurface& surface,
                            const Camera& camera,
                            const Lighting& lighting,
                            Pass pass = Pass::kBeauty,
                            const RenderOptions& options = {});

// The environment as N directional lights by importance sampling (A §VII): equal-energy regions of
// the map (median cut, Debevec 2005), each with its mean direction; irradiance is the sum over the
// region. Fewer than `count` where regions are single pixels or dark. Throws Error(kUsage) for
// count < 1.
[[nodiscard]] std::vector<Light> SampleEnvironment(const Environment& environment, int count);

}  // namespace dyxel
