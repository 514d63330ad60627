// The description that the built-in template is made from: skeleton, shape, sizes and blends.
#pragma once

#include <vector>

#include "dyxel/body/shape.h"
#include "dyxel/body/skeleton.h"

namespace dyxel {

// The segments, which are also the joints' indices.
enum Segment : int {
  kPelvis,
  kAbdomen,
  kChest,
  kHead,
  kLeftUpperArm,
  kLeftLowerArm,
  kLeftHand,
  kRightUpperArm,
  kRightLowerArm,
  kRightHand,
  kLeftThigh,
  kLeftShank,
  kLeftFoot,
  kRightThigh,
  kRightShank,
  kRightFoot,
  kNumSegments
};

// The segment of the other side; the same for the trunk's.
[[nodiscard]] int MirrorSegment(int segment);
// Unit direction of a segment's bone at rest, body frame: along it lengths are measured.
[[nodiscard]] Vec3d BoneDirection(int segment);

// Stature 1.75 m; bone lengths after Drillis and Contini (1966) as in Winter, Biomechanics and
// Motor Control of Human Movement (2009), fig. 4.1; ranges of motion after AAOS (1965) and, for the
// trunk's, White and Panjabi (1990), with a margin.
[[nodiscard]] Skeleton TemplateSkeleton();

// The skin of a person in plain clothes: trunk and limbs as lofts along the bones, head, hands and
// feet of smaller parts.
[[nodiscard]] Shape TemplateShape();
void AddHead(std::vector<ShapePrimitive>& parts);
void AddHand(const Vec3d& wrist, std::vector<ShapePrimitive>& parts);

// Wanted edge length at a rest position: 12 mm, finer at head, hands and feet.
[[nodiscard]] double TemplateEdgeLength(const Vec3d& x);

}  // namespace dyxel
