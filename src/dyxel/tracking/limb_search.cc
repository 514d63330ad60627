#include "dyxel/tracking/limb_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "dyxel/base/parallel.h"

namespace dyxel::internal {
namespace {

std::vector<const Dof*> AllDofs(const Skeleton& skeleton) {
  std::vector<const Dof*> dofs;
  for (const Joint& joint : skeleton.joints) {
    for (const Dof& dof : joint.dofs) dofs.push_back(&dof);
  }
  return dofs;
}

// The limb's bones as a polyline in its joints' frames; the last point is the farthest skin vertex
// of the end joint.
struct Bones {
  std::array<Vec3d, 4> points;  // world
};

Vec3d TipInJoint(const Actor& actor, const Limb& limb) {
  const int end = limb.joints.back();
  const Vec3d origin = actor.skeleton.RestPositions()[static_cast<std::size_t>(end)];
  Vec3d tip = origin;
  double farthest = 0;
  for (std::size_t v = 0; v < actor.skin.positions.size(); ++v) {
    if (actor.joint_indices[v][0] != end) continue;
    const Vec3d x = actor.skin.positions[v].cast<double>();
    if ((x - origin).norm() <= farthest) continue;
    farthest = (x - origin).norm();
    tip = x;
  }
  return tip - origin;
}

// Observed points that the rest of the body does not cover and the limb could reach.
struct ResidualPoints {
  std::vector<Vec2f> pixels;
  float area = 0;  // of the limb's drawing that a point stands for
};

// The area of a limb in squares of 3 cm.
constexpr float kLimbArea = 30 * 0.03F * 0.03F;
constexpr std::size_t kMostPoints = 160;  // a view

// The limb's bones in one view.
struct DrawnBones {
  std::array<Vec2f, 4> pixels;
  bool visible = false;

  // How many of the points lie farther than `radius` pixels from all bones.
  [[nodiscard]] int CountFar(const std::vector<Vec2f>& points, float radius) const {
    std::array<Vec2f, 3> along;
    std::array<float, 3> scale{};
    for (std::size_t k = 0; k < 3; ++k) {
      along[k] = pixels[k + 1] - pixels[k];
      scale[k] = 1 / std::max(along[k].squaredNorm(), 1e-9F);
    }
    const float limit = radius * radius;
    int count = 0;
    for (const Vec2f& p : points) {
      float nearest = limit + 1;
      for (std::size_t k = 0; k < 3; ++k) {
        const float x = p.x() - pixels[k].x();
        const float y = p.y() - pixels[k].y();
        const float t = std::clamp((x * along[k].x() + y * along[k].y()) * scale[k], 0.0F, 1.0F);
        const float dx = x - t * along[k].x();
        const float dy = y - t * along[k].y();
        nearest = std::min(nearest, dx * dx + dy * dy);
      }
      count += nearest > limit ? 1 : 0;
    }
    return count;
  }
};

std::vector<double> Levels(double low, double high, int n) {
  std::vector<double> levels;
  for (int i = 0; i < n; ++i) levels.push_back(low + (high - low) * (i + 0.5) / n);
  return levels;
}

// The mismatch with the limb drawn over the rest of the body.
double DrawnMismatch(PoseEvaluator& evaluator,
                     const std::vector<BodyView>& rest,
                     const std::vector<Vec3f>& positions,
                     const Limb& limb) {
  const Observation& observation = evaluator.observation();
  std::vector<double> parts(rest.size());
  ParallelFor(rest.size(), [&](std::size_t i) {
    BodyView view = rest[i];
    const View& observed = observation.views[i];
    view.Draw(observed, positions, evaluator.body().actor.skin.triangles, limb.triangles);
    const Overlap o = view.Compare(observed);
    parts[i] = static_cast<double>((o.either - o.both) / observed.norm);
  });
  return std::accumulate(parts.begin(), parts.end(), 0.0) /
         std::max<double>(1, static_cast<double>(parts.size()));
}

std::vector<BodyView> DrawRest(PoseEvaluator& evaluator,
                               const std::vector<Vec3f>& positions,
                               const Limb& limb) {
  const Observation& observation = evaluator.observation();
  std::vector<BodyView> rest(observation.views.size());
  ParallelFor(rest.size(), [&](std::size_t i) {
    rest[i].Clear(observation.views[i]);
    rest[i].Draw(
        observation.views[i], positions, evaluator.body().actor.skin.triangles, limb.others);
  });
  return rest;
}

}  // namespace

std::vector<Limb> FindLimbs(const Actor& actor) {
  std::vector<Limb> limbs;
  const Skeleton& skeleton = actor.skeleton;
  const std::vector<int> first = skeleton.FirstDof();
  for (const char* side : {"l_", "r_"}) {
    for (const bool arm : {true, false}) {
      Limb limb;
      limb.name = std::string(side) + (arm ? "arm" : "leg");
      const std::array<const char*, 3> names =
          arm ? std::array<const char*, 3>{"upper_arm", "lower_arm", "hand"}
              : std::array<const char*, 3>{"thigh", "shank", "foot"};
      for (const char* name : names) {
        const int joint = skeleton.FindJoint(std::string(side) + name);
        if (joint >= 0) limb.joints.push_back(joint);
      }
      if (limb.joints.size() != 3) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto j = static_cast<std::size_t>(limb.joints[k]);
        const int n = static_cast<int>(skeleton.joints[j].dofs.size());
        for (int d = 0; d < n; ++d) {
          limb.dofs.push_back(first[j] + d);
          if ((k == 0 && d < 3) || (k == 1 && d == 0)) limb.search.push_back(first[j] + d);
        }
      }
      for (std::size_t f = 0; f < actor.skin.triangles.size(); ++f) {
        int inside = 0;
        for (const int v : actor.skin.triangles[f]) {
          const int joint = actor.joint_indices[static_cast<std::size_t>(v)][0];
          inside += std::count(limb.joints.begin(), limb.joints.end(), joint) > 0 ? 1 : 0;
        }
        (inside >= 2 ? limb.triangles : limb.others).push_back(static_cast<int>(f));
      }
      if (limb.triangles.empty() || limb.search.empty()) continue;
      limbs.push_back(std::move(limb));
    }
  }
  return limbs;
}

LimbOverlap MeasureLimb(PoseEvaluator& evaluator, const Pose& pose, const Limb& limb) {
  const Observation& observation = evaluator.observation();
  const Actor& actor = evaluator.body().actor;
  const std::vector<Vec3f> positions = SkinPositions(actor, pose);
  const std::vector<Rigid> frames = actor.skeleton.Forward(pose);
  const Vec3f origin = frames[static_cast<std::size_t>(limb.joints[0])].translation.cast<float>();
  const Vec3f at_rest =
      actor.skeleton.RestPositions()[static_cast<std::size_t>(limb.joints[0])].cast<float>();
  float reach = 0;
  for (const int f : limb.triangles) {
    const auto v = static_cast<std::size_t>(actor.skin.triangles[static_cast<std::size_t>(f)][0]);
    reach = std::max(reach, (actor.skin.positions[v] - at_rest).norm());
  }
  std::vector<LimbOverlap> parts(observation.views.size());
  ParallelFor(parts.size(), [&](std::size_t i) {
    const View& view = observation.views[i];
    BodyView drawing;
    drawing.Clear(view);
    drawing.Draw(view, positions, actor.skin.triangles, limb.triangles);
    const Overlap alone = drawing.Compare(view);
    if (alone.model < 1) return;
    parts[i].outside = static_cast<double>((alone.model - alone.both) / alone.model);
    drawing.Draw(view, positions, actor.skin.triangles, limb.others);
    const Vec3f p = Projector(*view.camera)(origin);
    const float reach_px = reach / view.metres_per_pixel;
    const DistanceField& field = view.field;
    int missed = 0;
    for (int y = 0; y < field.value.height; ++y) {
      for (int x = 0; x < field.value.width; ++x) {
        if (field.value.At(x, y) <= 0) continue;
        const Vec2f pixel(static_cast<float>(field.left) +
                              static_cast<float>(field.step) * (static_cast<float>(x) + 0.5F),
                          static_cast<float>(field.top) +
                              static_cast<float>(field.step) * (static_cast<float>(y) + 0.5F));
        if ((pixel - p.head<2>()).squaredNorm() > reach_px * reach_px) continue;
        if (!drawing.Covered(view, pixel)) ++missed;
      }
    }
    parts[i].missed = static_cast<double>(missed) / static_cast<double>(alone.model);
  });
  LimbOverlap mean;
  for (const LimbOverlap& part : parts) {
    mean.outside += part.outside / static_cast<double>(parts.size());
    mean.missed += part.missed / static_cast<double>(parts.size());
  }
  return mean;
}

std::vector<LimbCandidate> SearchLimb(PoseEvaluator& evaluator,
                                      const Pose& pose,
                                      const Limb& limb,
                                      int keep) {
  const Observation& observation = evaluator.observation();
  const Actor& actor = evaluator.body().actor;
  const std::vector<const Dof*> dofs = AllDofs(actor.skeleton);
  const std::vector<Vec3f> positions = SkinPositions(actor, pose);
  const std::vector<BodyView> rest = DrawRest(evaluator, positions, limb);

  const bool leg = limb.name.ends_with("leg");
  const float radius = leg ? 0.07F : 0.045F;
  const Vec3d tip = TipInJoint(actor, limb);
  const std::vector<Rigid> now = actor.skeleton.Forward(pose);
  const auto joint = [&](std::size_t k) { return static_cast<std::size_t>(limb.joints[k]); };
  const float reach =
      static_cast<float>((now[joint(1)].translation - now[joint(0)].translation).norm() +
                         (now[joint(2)].translation - now[joint(1)].translation).norm() +
                         tip.norm()) +
      1.2F * radius;

  std::vector<ResidualPoints> residual(rest.size());
  std::vector<Projector> projectors;
  for (const View& view : observation.views) projectors.emplace_back(*view.camera);
  ParallelFor(rest.size(), [&](std::size_t i) {
    const View& view = observation.views[i];
    const DistanceField& field = view.field;
    const Vec2f root = projectors[i](now[joint(0)].translation.cast<float>()).head<2>();
    const float reach_px = reach / view.metres_per_pixel;
    const float cell = view.metres_per_pixel * static_cast<float>(field.step);
    const int stride = std::max(1, static_cast<int>(0.03F / cell));
    std::vector<Vec2f> all;
    for (int y = stride / 2; y < field.value.height; y += stride) {
      for (int x = stride / 2; x < field.value.width; x += stride) {
        if (field.value.At(x, y) <= 0) continue;
        const Vec2f pixel(static_cast<float>(field.left) +
                              static_cast<float>(field.step) * (static_cast<float>(x) + 0.5F),
                          static_cast<float>(field.top) +
                              static_cast<float>(field.step) * (static_cast<float>(y) + 0.5F));
        if ((pixel - root).squaredNorm() > reach_px * reach_px) continue;
        if (!rest[i].Covered(view, pixel)) all.push_back(pixel);
      }
    }
    const std::size_t every = all.size() / kMostPoints + 1;
    for (std::size_t k = every / 2; k < all.size(); k += every)
      residual[i].pixels.push_back(all[k]);
    const float side = cell * static_cast<float>(stride);
    residual[i].area = side * side * static_cast<float>(every) / kLimbArea;
  });

  // The grid of angles.
  const std::array<int, 4> counts =
      leg ? std::array<int, 4>{9, 6, 3, 6} : std::array<int, 4>{9, 7, 5, 5};
  std::vector<std::vector<double>> levels;
  for (std::size_t k = 0; k < limb.search.size(); ++k) {
    const Dof& dof = *dofs[static_cast<std::size_t>(limb.search[k])];
    levels.push_back(Levels(dof.min, dof.max, counts[std::min<std::size_t>(k, 3)]));
  }
  std::size_t total = 1;
  for (const auto& l : levels) total *= l.size();
  struct Scored {
    double score;  // (T7): its first term, then the whole
    std::size_t index;
    bool operator<(const Scored& other) const {
      return score < other.score || (score == other.score && index < other.index);
    }
  };
  const auto pose_of = [&](std::size_t index) {
    Pose p = pose;
    for (const int d : limb.dofs) {
      const Dof& dof = *dofs[static_cast<std::size_t>(d)];
      p.angles[static_cast<std::size_t>(d)] = std::clamp(0.0, dof.min, dof.max);
    }
    for (std::size_t k = 0; k < levels.size(); ++k) {
      p.angles[static_cast<std::size_t>(limb.search[k])] = levels[k][index % levels[k].size()];
      index /= levels[k].size();
    }
    return p;
  };
  std::vector<Scored> scored(total);
  std::vector<DrawnBones> bones(total * rest.size());
  ParallelForBlocks(total, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t index = begin; index < end; ++index) {
      const std::vector<Rigid> frames = actor.skeleton.Forward(pose_of(index));
      std::array<Vec3f, 4> points;
      for (std::size_t k = 0; k < 3; ++k) points[k] = frames[joint(k)].translation.cast<float>();
      points[3] = (frames[joint(2)] * tip).cast<float>();
      double score = 0;
      for (std::size_t i = 0; i < rest.size(); ++i) {
        const View& view = observation.views[i];
        DrawnBones& drawn = bones[index * rest.size() + i];
        drawn.visible = true;
        for (std::size_t k = 0; k < 4; ++k) {
          const Vec3f p = projectors[i](points[k]);
          drawn.visible &= p.z() > 0;
          drawn.pixels[k] = p.head<2>();
        }
        if (!drawn.visible) continue;
        float outside = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          for (int s = 0; s < 4; ++s) {
            const float t = (static_cast<float>(s) + 0.5F) / 4;
            const Vec2f p = drawn.pixels[k] + t * (drawn.pixels[k + 1] - drawn.pixels[k]);
            const DistanceField& field = view.partial() ? view.outer : view.field;
            const float depth = field.At(p) * view.metres_per_pixel;
            const float r = k == 2 ? 0.02F : 0.6F * radius;
            outside += std::clamp(r - depth, 0.0F, 0.25F) / 0.25F;
          }
        }
        score += static_cast<double>(outside) / 12;
      }
      scored[index] = {score, index};
    }
  });
  // The second term, which is not negative, is only computed where the first leaves a chance.
  std::sort(scored.begin(), scored.end());
  const std::size_t drawn = std::min<std::size_t>(14, total);
  constexpr std::size_t kBlock = 128;
  std::vector<Scored> best;
  for (std::size_t begin = 0; begin < total; begin += kBlock) {
    if (best.size() == drawn && scored[begin].score >= best.back().score) break;
    const std::size_t end = std::min(total, begin + kBlock);
    ParallelForBlocks(end - begin, 16, [&](std::size_t first, std::size_t last) {
      for (std::size_t n = begin + first; n < begin + last; ++n) {
        for (std::size_t i = 0; i < rest.size(); ++i) {
          const DrawnBones& view_bones = bones[scored[n].index * rest.size() + i];
          if (!view_bones.visible) continue;
          const float radius_px = 1.2F * radius / observation.views[i].metres_per_pixel;
          scored[n].score +=
              static_cast<double>(residual[i].area * static_cast<float>(view_bones.CountFar(
                                                         residual[i].pixels, radius_px)));
        }
      }
    });
    best.insert(best.end(),
                scored.begin() + static_cast<std::ptrdiff_t>(begin),
                scored.begin() + static_cast<std::ptrdiff_t>(end));
    std::sort(best.begin(), best.end());
    best.resize(std::min(best.size(), drawn));
  }
  std::vector<LimbCandidate> candidates;
  candidates.push_back({pose, DrawnMismatch(evaluator, rest, positions, limb)});
  for (std::size_t k = 0; k < drawn; ++k) {
    Pose p = pose_of(best[k].index);
    const std::vector<Vec3f> moved = SkinPositions(actor, p);
    const double mismatch = DrawnMismatch(evaluator, rest, moved, limb);
    candidates.push_back({std::move(p), mismatch});
  }
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.mismatch < b.mismatch;
  });
  if (candidates.size() > static_cast<std::size_t>(keep)) {
    candidates.resize(static_cast<std::size_t>(keep));
  }
  return candidates;
}

}  // namespace dyxel::internal
