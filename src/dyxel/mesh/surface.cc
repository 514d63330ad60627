#include "dyxel/mesh/surface.h"

#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {
namespace {

// Any unit vector normal to n (Duff et al. 2017), for vertices whose triangles have no extent in
// uv.
Vec3f AnyTangent(const Vec3f& n) {
  const float sign = std::copysign(1.0F, n.z());
  const float a = -1.0F / (sign + n.z());
  return {1.0F + sign * n.x() * n.x() * a, sign * n.x() * n.y() * a, -sign * n.x()};
}

}  // namespace

PosedSurface PoseSurface(const Atlas& atlas,
                         std::span<const Triangle> skin_triangles,
                         std::span<const Vec3f> skin_positions,
                         std::span<const Vec3f> normal_positions) {
  const std::span<const Vec3f> shading =
      normal_positions.empty() ? skin_positions : normal_positions;
  const std::vector<Vec3f> skin_normals = VertexNormals(shading, skin_triangles);
  const std::size_t num_cut = atlas.skin_vertex.size();
  PosedSurface surface;
  surface.positions.resize(num_cut);
  surface.normals.resize(num_cut);
  surface.tangents.assign(num_cut, Vec3f::Zero());
  surface.handedness.assign(num_cut, 0.0F);
  for (std::size_t c = 0; c < num_cut; ++c) {
    const auto v = static_cast<std::size_t>(atlas.skin_vertex[c]);
    surface.positions[c] = skin_positions[v];
    surface.normals[c] = skin_normals[v].isZero(0.0F) ? Vec3f::UnitZ() : skin_normals[v];
  }
  // Tangents: the gradient of u in each triangle, weighted by its area; handedness: whether u and v
  // turn as seen from outside (v grows downwards, so an unmirrored triangle's area is negative).
  for (const Triangle& t : atlas.triangles) {
    const auto a = static_cast<std::size_t>(t[0]);
    const auto b = static_cast<std::size_t>(t[1]);
    const auto c = static_cast<std::size_t>(t[2]);
    const Vec3f& origin = shading[static_cast<std::size_t>(atlas.skin_vertex[a])];
    const Vec3f ab = shading[static_cast<std::size_t>(atlas.skin_vertex[b])] - origin;
    const Vec3f ac = shading[static_cast<std::size_t>(atlas.skin_vertex[c])] - origin;
    const Vec2f uv_ab = atlas.uv_i[b] - atlas.uv_i[a];
    const Vec2f uv_ac = atlas.uv_i[c] - atlas.uv_i[a];
    const float uv_area = uv_ab.x() * uv_ac.y() - uv_ab.y() * uv_ac.x();
    if (uv_area == 0) continue;
    // dx/du times |uv_area|, so that big triangles of the atlas count more.
    const float sign = uv_area > 0 ? 1.0F : -1.0F;
    const Vec3f along_u = (ab * uv_ac.y() - ac * uv_ab.y()) * sign;
    for (const std::size_t corner : {a, b, c}) {
      surface.tangents[corner] += along_u;
      surface.handedness[corner] -= uv_area;
    }
  }
  for (std::size_t c = 0; c < num_cut; ++c) {
    const Vec3f& n = surface.normals[c];
    Vec3f t = surface.tangents[c] - n * n.dot(surface.tangents[c]);
    const float length = t.norm();
    surface.tangents[c] = length > 1e-20F ? Vec3f(t / length) : AnyTangent(n);
    surface.handedness[c] = surface.handedness[c] < 0 ? -1.0F : 1.0F;
  }
  return surface;
}

Mat3f TangentFrame(const PosedSurface& surface, const Triangle& triangle, const Vec3f& bary) {
  const auto a = static_cast<std::size_t>(triangle[0]);
  const auto b = static_cast<std::size_t>(triangle[1]);
  const auto c = static_cast<std::size_t>(triangle[2]);
  const Vec3f n =
      (surface.normals[a] * bary[0] + surface.normals[b] * bary[1] + surface.normals[c] * bary[2])
          .normalized();
  Vec3f t =
      surface.tangents[a] * bary[0] + surface.tangents[b] * bary[1] + surface.tangents[c] * bary[2];
  t -= n * n.dot(t);
  const float length = t.norm();
  t = length > 1e-6F ? Vec3f(t / length) : AnyTangent(n);
  Mat3f frame;
  frame.col(0) = t;
  frame.col(1) = surface.handedness[a] * n.cross(t);
  frame.col(2) = n;
  return frame;
}

}  // namespace dyxel
