#include "dyxel/studio/tracer.h"

#include <cstring>
#include <limits>

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include "dyxel/base/error.h"

namespace dyxel::studio {
namespace {

// One device a process, which Embree wants; freed at exit.
RTCDevice Device() {
  struct Owner {
    RTCDevice device = rtcNewDevice("set_affinity=0");
    ~Owner() { rtcReleaseDevice(device); }
  };
  static const Owner owner;
  Require(owner.device != nullptr, Fault::kStage, "Embree cannot start on this machine");
  return owner.device;
}

template <class Ray>
void Fill(const RayPacket& rays, Ray& ray, int* valid) {
  for (std::size_t i = 0; i < kRays; ++i) {
    valid[i] = rays.active[i] ? -1 : 0;
    ray.org_x[i] = rays.active[i] ? rays.origin[i].x() : 0;
    ray.org_y[i] = rays.active[i] ? rays.origin[i].y() : 0;
    ray.org_z[i] = rays.active[i] ? rays.origin[i].z() : 0;
    ray.dir_x[i] = rays.active[i] ? rays.direction[i].x() : 1;
    ray.dir_y[i] = rays.active[i] ? rays.direction[i].y() : 0;
    ray.dir_z[i] = rays.active[i] ? rays.direction[i].z() : 0;
    ray.tnear[i] = rays.near[i];
    ray.tfar[i] = rays.active[i] ? rays.far[i] : -1;
    ray.time[i] = 0;
    ray.mask[i] = ~0U;
    ray.id[i] = 0;
    ray.flags[i] = 0;
  }
}

}  // namespace

struct Tracer::State {
  RTCScene scene = nullptr;
  ~State() { rtcReleaseScene(scene); }
};

Tracer::Tracer(std::span<const Vec3f> positions, std::span<const Triangle> triangles)
    : state_(std::make_unique<State>()) {
  const RTCDevice device = Device();
  state_->scene = rtcNewScene(device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertex = rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), positions.size());
  std::memcpy(vertex, positions.data(), positions.size_bytes());
  void* index = rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), triangles.size());
  std::memcpy(index, triangles.data(), triangles.size_bytes());
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(state_->scene, geometry);
  rtcReleaseGeometry(geometry);
  tbb::task_arena alone(1);
  alone.execute([&] { rtcJoinCommitScene(state_->scene); });
  Require(rtcGetDeviceError(device) == RTC_ERROR_NONE,
          Fault::kStage,
          "Embree could not build a surface of {} triangles",
          triangles.size());
  for (const Vec3f& p : positions) bounds_.extend(p);
}

Tracer::~Tracer() = default;

PacketHits Tracer::Trace(const RayPacket& rays, bool coherent) const {
  RTCRayHit8 query;
  alignas(32) std::array<int, kRays> valid;
  Fill(rays, query.ray, valid.data());
  for (std::size_t i = 0; i < kRays; ++i) {
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect8(valid.data(), state_->scene, &context, &query);
  PacketHits hits;
  for (std::size_t i = 0; i < kRays; ++i) {
    const bool hit = rays.active[i] && query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    hits.triangle[i] = hit ? static_cast<int>(query.hit.primID[i]) : -1;
    hits.distance[i] = hit ? query.ray.tfar[i] : std::numeric_limits<float>::infinity();
    const float u = query.hit.u[i];
    const float v = query.hit.v[i];
    hits.bary[i] = hit ? Vec3f(1 - u - v, u, v) : Vec3f::Zero();
  }
  return hits;
}

std::array<bool, kRays> Tracer::Occluded(const RayPacket& rays, bool coherent) const {
  RTCRay8 query;
  alignas(32) std::array<int, kRays> valid;
  Fill(rays, query, valid.data());
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcOccluded8(valid.data(), state_->scene, &context, &query);
  std::array<bool, kRays> occluded;
  for (std::size_t i = 0; i < kRays; ++i) occluded[i] = rays.active[i] && query.tfar[i] < 0;
  return occluded;
}

}  // namespace dyxel::studio
