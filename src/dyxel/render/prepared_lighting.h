// What PreparedLighting holds.
#pragma once

#include <vector>

#include "dyxel/render/renderer.h"
#include "dyxel/render/shade.h"

namespace dyxel {

struct PreparedLighting::Data {
  std::vector<internal::ShadeLight> shade_lights;
  std::vector<ShadowMap> shadows;  // one a light
};

}  // namespace dyxel
