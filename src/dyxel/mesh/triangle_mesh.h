// Triangle meshes: one topology, any number of positions; smoothing: docs/method.md (V5).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel {

struct TriangleMesh {
  std::vector<Vec3f> positions;     // (V)
  std::vector<Triangle> triangles;  // (F), counter-clockwise seen from outside
};

// Area-weighted unit vertex normals (V); zero for a vertex without area.
[[nodiscard]] std::vector<Vec3f> VertexNormals(std::span<const Vec3f> positions,
                                               std::span<const Triangle> triangles);

// `rounds` of x <- x/2 + mean(neighbours)/2 over the mesh's edges (V) (`--smooth-normals`).
[[nodiscard]] std::vector<Vec3f> SmoothPositions(std::span<const Vec3f> positions,
                                                 std::span<const Triangle> triangles,
                                                 int rounds);

// PLY, ASCII or binary little endian, positions and faces (polygons are fanned). Throws
// Error(kInput) with the file where it is damaged.
[[nodiscard]] TriangleMesh ReadPly(const std::filesystem::path& path);

// Further numbers of a PLY file's vertices by name ("s", "t" of texture coordinates; "sx" … of the
// truth's shift): [name][vertex]. Empty where the file does not have all of them.
[[nodiscard]] std::vector<std::vector<float>> ReadPlyVertexProperties(
    const std::filesystem::path& path, std::span<const std::string> names);

// Binary little endian, atomically.
void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace dyxel
