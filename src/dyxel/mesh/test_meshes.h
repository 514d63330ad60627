// Small closed-form surfaces for tests.
#pragma once

#include <cmath>

#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {

// A sphere of `rings` times 2·`rings` facets around `center`; its poles are single vertices.
inline TriangleMesh MakeSphere(const Vec3f& center, float radius, int rings) {
  TriangleMesh mesh;
  const int columns = 2 * rings;
  mesh.positions.push_back(center + radius * Vec3f::UnitZ());
  for (int r = 1; r < rings; ++r) {
    const float theta = kPi * static_cast<float>(r) / static_cast<float>(rings);
    for (int c = 0; c < columns; ++c) {
      const float phi = 2 * kPi * static_cast<float>(c) / static_cast<float>(columns);
      mesh.positions.push_back(center + radius * Vec3f(std::sin(theta) * std::cos(phi),
                                                       std::sin(theta) * std::sin(phi),
                                                       std::cos(theta)));
    }
  }
  mesh.positions.push_back(center - radius * Vec3f::UnitZ());
  const int last = static_cast<int>(mesh.positions.size()) - 1;
  const auto at = [&](int r, int c) { return 1 + (r - 1) * columns + c % columns; };
  for (int c = 0; c < columns; ++c) {
    mesh.triangles.push_back({0, at(1, c), at(1, c + 1)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, c), at(r + 1, c), at(r + 1, c + 1)});
      mesh.triangles.push_back({at(r, c), at(r + 1, c + 1), at(r, c + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, c), last, at(rings - 1, c + 1)});
  }
  return mesh;
}

// The square [-1, 1]² · half in the plane z = height, facing up, of n × n cells.
inline TriangleMesh MakeSquare(float height, float half, int n) {
  TriangleMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      mesh.positions.emplace_back(half * (2 * static_cast<float>(i) / static_cast<float>(n) - 1),
                                  half * (2 * static_cast<float>(j) / static_cast<float>(n) - 1),
                                  height);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int at = j * (n + 1) + i;
      mesh.triangles.push_back({at, at + 1, at + n + 2});
      mesh.triangles.push_back({at, at + n + 2, at + n + 1});
    }
  }
  return mesh;
}

// Appends `other` to `mesh`.
inline void Append(TriangleMesh& mesh, const TriangleMesh& other) {
  const int shift = static_cast<int>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const Triangle& t : other.triangles) {
    mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
}

// A tube of radius 1 and height 2π about z, cut open along x > 0 and laid flat and unmirrored:
// `columns` around (their first and last are the same skin vertices), `rows` along, in the middle
// half of the texture.
struct Tube {
  TriangleMesh skin;
  Atlas atlas;
};
inline Tube MakeTube(int columns, int rows, int size) {
  Tube tube;
  tube.atlas.size = size;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      const float u = static_cast<float>(c) / static_cast<float>(columns);
      const float v = static_cast<float>(r) / static_cast<float>(rows);
      if (c < columns) {
        tube.skin.positions.emplace_back(std::cos(2 * kPi * u), std::sin(2 * kPi * u), 2 * kPi * v);
      }
      tube.atlas.skin_vertex.push_back(r * columns + c % columns);
      tube.atlas.uv_i.emplace_back(0.25F + 0.5F * u, 0.75F - 0.5F * v);
    }
  }
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int at = r * (columns + 1) + c;
      tube.atlas.triangles.push_back({at, at + 1, at + columns + 2});
      tube.atlas.triangles.push_back({at, at + columns + 2, at + columns + 1});
    }
  }
  for (const Triangle& t : tube.atlas.triangles) {
    Triangle skin;
    for (std::size_t c = 0; c < 3; ++c) {
      skin[c] = tube.atlas.skin_vertex[static_cast<std::size_t>(t[c])];
    }
    tube.skin.triangles.push_back(skin);
  }
  return tube;
}

}  // namespace dyxel
