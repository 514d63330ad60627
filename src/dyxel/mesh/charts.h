// The charts of parameterization I: a skin cut open, its pieces flattened, divided where they
// overlap themselves or pack badly.
#pragma once

#include <span>
#include <vector>

#include "dyxel/mesh/half_edges.h"

namespace dyxel::internal {

// A closed skin with what is known of its edges.
struct Skin {
  std::span<const Vec3f> positions;     // (V)
  std::span<const Triangle> triangles;  // (F)
  std::vector<int> twins;               // (3F)
  VertexGraph graph;
};

// One chart: the triangles of one piece, as a mesh of its own.
struct Chart {
  std::vector<int> members;         // triangles of the skin, ascending
  std::vector<int> vertices;        // of the cut mesh
  std::vector<Triangle> triangles;  // by index into `vertices`
  std::vector<Vec3f> positions;
  std::vector<int> border;  // loop
  std::vector<Vec2d> uv;    // metres
};
struct Charts {
  CutMesh mesh;
  std::vector<Chart> charts;
};

// Flattens the pieces that `cut` (3F) leaves; a piece that overlaps itself is cut further until
// none does.
[[nodiscard]] Charts FlattenCharts(const Skin& skin, std::vector<char>& cut);

// Cuts charts where that saves a good deal of the area of their hulls. Their maps stay.
void TightenCharts(const Skin& skin, std::vector<char>& cut, Charts& charts);

[[nodiscard]] std::vector<Vec2d> BorderInPlane(const Chart& chart);

}  // namespace dyxel::internal
