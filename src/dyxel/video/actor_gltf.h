// The actor as glTF nodes, skin and vertices, and back; and as a file of its own (actor/actor.glb).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "dyxel/body/actor.h"
#include "dyxel/video/glb.h"

namespace dyxel {

// One .glb: the skin in its rest pose, the skeleton (each joint's node has its hinges with axes and
// limits in its extras) and the weights. The same actor gives the same bytes. Throws Error(kUsage)
// for an actor whose arrays disagree, Error(kStage) where the file can't be written.
void WriteActor(const std::filesystem::path& path, const Actor& actor);

// What WriteActor wrote, exactly (an influence without weight comes back as joint 0). Throws
// Error(kInput) with the file where it is missing, damaged or holds no Dyxel actor.
[[nodiscard]] Actor ReadActor(const std::filesystem::path& path);

namespace internal {

// Throws Error(kUsage) where the arrays of the actor don't belong together.
void CheckActor(const Actor& actor);

// The nodes, skin and inverse bind matrices of a skeleton: its root hangs under a new node "world",
// which turns `up` to glTF's +Y.
struct SkeletonNodes {
  int world = 0;
  int skin = 0;
  std::vector<int> joints;  // (J) node of each joint
};
[[nodiscard]] SkeletonNodes AddSkeleton(GlbBuilder& glb, const Skeleton& skeleton, const Vec3d& up);
// The node "world" alone.
int AddWorldNode(GlbBuilder& glb, const Vec3d& up);

// JOINTS_0 and WEIGHTS_0 of `vertices` (indices of skin vertices) in a primitive's attributes.
void AddInfluences(GlbBuilder& glb,
                   const Actor& actor,
                   std::span<const int> vertices,
                   Json& attributes);

// The skeleton under a skin, in the order of its joints.
[[nodiscard]] Skeleton ReadSkeleton(const GlbFile& glb, int skin);

// Influences of `count` vertices of a primitive, for the skeleton's `joints`.
struct Influences {
  std::vector<std::array<int, 4>> joints;
  std::vector<std::array<float, 4>> weights;
};
[[nodiscard]] Influences ReadInfluences(const GlbFile& glb,
                                        const Json& attributes,
                                        std::size_t count,
                                        int joints);

// Flat arrays of vectors, and back.
[[nodiscard]] std::vector<float> Flatten(std::span<const Vec3f> vectors);
[[nodiscard]] std::vector<Vec3f> Unflatten(std::span<const float> values);
[[nodiscard]] std::vector<std::uint32_t> FlattenTriangles(std::span<const Triangle> triangles);
// Triangles of an index accessor over `vertices`.
[[nodiscard]] std::vector<Triangle> ReadTriangles(const GlbFile& glb, int accessor, int vertices);

}  // namespace internal
}  // namespace dyxel
