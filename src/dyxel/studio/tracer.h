// Ray tracing against one posed person, eight rays at a time (Embree 3).
#pragma once

#include <array>
#include <memory>
#include <span>

#include "dyxel/math/types.h"

namespace dyxel::studio {

inline constexpr int kRays = 8;

// Eight rays; inactive lanes are not traced.
struct RayPacket {
  std::array<bool, kRays> active{};
  std::array<Vec3f, kRays> origin;
  std::array<Vec3f, kRays> direction;  // unit
  std::array<float, kRays> near{};
  std::array<float, kRays> far{};
};

struct PacketHits {
  std::array<int, kRays> triangle;  // -1 for none
  std::array<float, kRays> distance;
  std::array<Vec3f, kRays> bary;
};

// A surface to trace. Building is single-threaded, so that the hierarchy, and with it the choice
// between two triangles at an edge, never depends on the number of threads.
class Tracer {
 public:
  Tracer(std::span<const Vec3f> positions, std::span<const Triangle> triangles);
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  // The nearest triangle on each active ray. `coherent` is a hint that the rays lie close.
  [[nodiscard]] PacketHits Trace(const RayPacket& rays, bool coherent) const;
  // Which active rays meet anything.
  [[nodiscard]] std::array<bool, kRays> Occluded(const RayPacket& rays, bool coherent) const;

  [[nodiscard]] const Eigen::AlignedBox3f& bounds() const { return bounds_; }

 private:
  struct State;
  std::unique_ptr<State> state_;
  Eigen::AlignedBox3f bounds_;
};

}  // namespace dyxel::studio
