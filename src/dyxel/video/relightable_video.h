// The relightable video in memory (docs/asset-format.md): one actor, one DSS.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dyxel/body/actor.h"
#include "dyxel/image/image.h"
#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/reflectance/reflectance.h"

namespace dyxel {

// The maps of a surface in the atlas, gutters filled: what is rendered from.
struct MaterialMaps {
  std::string model;  // BRDF table's name
  std::vector<Material> materials;
  ImageF diffuse;     // [size][size][3] linear albedo
  ImageF specular;    // [size][size][P]
  ImageU8 material;   // [size][size][1]
  ImageF confidence;  // [size][size][1]
  ImageF normal;      // [size][size][3] unit, tangent frame: the RES's second pass
};

// A normal map that belongs to one instant; between two, docs/method.md (N3).
struct NormalKey {
  double frame = 0;  // in frames of the sequence
  ImageF normal;     // [size][size][3] unit, tangent frame
};

struct RelightableVideo {
  std::string name;      // capture's
  std::string sequence;  // the DSS
  double fps = 25;
  Vec3d up = Vec3d::UnitZ();
  Atlas atlas;
  std::vector<Triangle> skin_triangles;  // (F) of skin vertices
  // Either a skinned actor with its motion …
  std::optional<Actor> actor;
  Motion motion;
  // … or given surfaces, world: [frames] of (V), and those whose normals they wear, if other.
  std::vector<std::vector<Vec3f>> positions;
  std::vector<std::vector<Vec3f>> normal_positions;
  MaterialMaps maps;
  std::vector<NormalKey> normals;

  [[nodiscard]] int NumFrames() const {
    return static_cast<int>(actor ? motion.poses.size() : positions.size());
  }
};

// The normal map at a (fractional) frame: slerp between keys, clamped at the ends; the maps' own
// where there are no keys.
[[nodiscard]] ImageF NormalMapAt(const RelightableVideo& video, double frame);

// The skin's positions at a (fractional) frame, world (V): poses interpolated (slerp), given
// surfaces linearly.
// Throws Error(kUsage) for a video without frames.
[[nodiscard]] std::vector<Vec3f> SkinPositionsAt(const RelightableVideo& video, double frame);

// The positions whose normals the surface wears (V); empty where those are the skin's own.
[[nodiscard]] std::vector<Vec3f> NormalPositionsAt(const RelightableVideo& video, double frame);

// The posed surface of a (fractional) frame: SkinPositionsAt and NormalPositionsAt together.
[[nodiscard]] PosedSurface SurfaceAt(const RelightableVideo& video, double frame);

}  // namespace dyxel
