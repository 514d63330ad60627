// Names for Eigen's small fixed types. Positions are metres, angles radians, unless a name says
// else.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dyxel {

using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec4f = Eigen::Vector4f;
using Vec2d = Eigen::Vector2d;
using Vec3d = Eigen::Vector3d;
using Vec4d = Eigen::Vector4d;
using Mat3f = Eigen::Matrix3f;
using Mat3d = Eigen::Matrix3d;
using Mat4f = Eigen::Matrix4f;
using Mat4d = Eigen::Matrix4d;
// Not over-aligned: standard algorithms' buffers (std::stable_sort's) know no alignment beyond
// malloc's.
using Quatf = Eigen::Quaternion<float, Eigen::DontAlign>;
using Quatd = Eigen::Quaternion<double, Eigen::DontAlign>;

// Three vertex indices, counter-clockwise seen from outside.
using Triangle = std::array<int, 3>;

// Linear RGB (BT.709 primaries).
using Rgb = Eigen::Array3f;

inline constexpr float kPi = 3.14159265358979F;
inline constexpr double kPiD = 3.14159265358979323846;

}  // namespace dyxel
