#include "dyxel/tracking/pose_solver.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"
#include "dyxel/tracking/limb_search.h"
#include "dyxel/tracking/sequence_tracker.h"
#include "dyxel/tracking/synthetic_rig.h"
#include "dyxel/tracking/visual_hull.h"

namespace dyxel::internal {
namespace {

ImageU8 DiscMask(int size, double cx, double cy, double radius) {
  ImageU8 mask(size, size, 1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      if (std::hypot(x + 0.5 - cx, y + 0.5 - cy) < radius) mask.At(x, y) = 255;
    }
  }
  return mask;
}

TEST(DistanceField, OfADisc) {
  for (const int step : {1, 2}) {
    const DistanceField field = MakeDistanceField(DiscMask(160, 80.3, 70.6, 40), step, 30);
    for (const Vec2f& p : {Vec2f(80, 120), Vec2f(110, 70), Vec2f(60, 50), Vec2f(125, 75)}) {
      const double truth =
          40 - std::hypot(static_cast<double>(p.x()) - 80.3, static_cast<double>(p.y()) - 70.6);
      EXPECT_NEAR(static_cast<double>(field.At(p)), truth, 0.7) << step;
    }
    // Beyond the grid the distance goes on falling.
    EXPECT_NEAR(static_cast<double>(field.At(Vec2f(155, 70.6F))), 40 - 74.7, 3);
    const Contour contour = SampleContour(field, 4);
    EXPECT_NEAR(contour.spacing * static_cast<float>(contour.samples.size()), 2 * kPi * 40, 12);
    for (const ContourSample& s : contour.samples) {
      const Vec2f out = s.pixel - Vec2f(80.3F, 70.6F);
      EXPECT_NEAR(out.norm(), 40, 0.6);
      EXPECT_GT(s.normal.dot(out.normalized()), 0.95F);
    }
  }
}

TEST(DistanceField, IgnoresThePicturesBorder) {
  // The disc is cut off by the left border: no contour there.
  const DistanceField field = MakeDistanceField(DiscMask(160, 5, 80, 40), 1, 30);
  for (const ContourSample& s : SampleContour(field, 3).samples) EXPECT_GT(s.pixel.x(), 1.9F);
  EXPECT_GT(field.At(Vec2f(1, 80)), 30);
}

TEST(VisualHull, OfASphere) {
  const std::vector<Camera> cameras = RingOfCameras(7, 200);
  const Vec3d center(0.2, -0.1, 1.1);
  std::vector<ImageU8> masks;
  for (const Camera& camera : cameras) {
    ImageU8 mask(200, 200, 1);
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 200; ++x) {
        const Vec3d ray = camera.Ray(Vec2d(x + 0.5, y + 0.5));
        if (ray.cross(center - camera.Center()).norm() < 0.3) mask.At(x, y) = 255;
      }
    }
    masks.push_back(mask);
  }
  const HullSummary hull = FindHull(cameras, masks, Vec3d::UnitZ());
  ASSERT_TRUE(hull.found);
  EXPECT_LT((hull.center - center).norm(), 0.02);
  EXPECT_LT((hull.trunk - center).norm(), 0.04);
  EXPECT_NEAR(hull.top, 1.4, 0.05);
  EXPECT_NEAR(hull.bottom, 0.8, 0.06);
  masks.assign(cameras.size(), ImageU8(200, 200, 1));
  EXPECT_FALSE(FindHull(cameras, masks, Vec3d::UnitZ()).found);
}

// A posture that no part of the start knows.
Pose SomePose(const Skeleton& skeleton) {
  Pose pose = skeleton.RestPose();
  pose.root_translation += Vec3d(0.1, -0.05, 0.03);
  pose.root_rotation =
      Quatd(Eigen::AngleAxisd(2.2, Vec3d::UnitZ())) * Quatd(Eigen::AngleAxisd(0.1, Vec3d::UnitX()));
  Angle(skeleton, pose, "l_shoulder_elevation") = 0.6;
  Angle(skeleton, pose, "l_elbow_flexion") = 0.7;
  Angle(skeleton, pose, "r_elbow_flexion") = 0.4;
  Angle(skeleton, pose, "r_hip_flexion") = 0.5;
  Angle(skeleton, pose, "r_knee_flexion") = 0.6;
  return pose;
}

// The gradient of Σ w (r + g · (x(p) − x(p0)))² / 2 against differences, and its matrix by its
// product with a step.
TEST(BuildPoseEquations, AgreesWithDifferences) {
  const Actor& body = SmallBody();
  const Pose pose = SomePose(body.skeleton);
  const std::vector<Vec3f> at = SkinPositions(body, pose);
  Random random(3);
  std::vector<std::vector<Match>> matches(2);
  for (int k = 0; k < 60; ++k) {
    const auto v = static_cast<int>(random.Below(static_cast<std::uint32_t>(at.size())));
    const Vec3f g = Vec3f(random.Normal(), random.Normal(), random.Normal()).normalized();
    matches[static_cast<std::size_t>(k % 2)].push_back({v, g, 0.02F * random.Normal(), 0.01F});
  }
  const float scale = 0.05F;
  const NormalEquations system = BuildPoseEquations(body, pose, matches, scale);
  const auto cost = [&](const Eigen::VectorXd& step) {
    const PoseDerivatives d = ComputePoseDerivatives(
        body.skeleton,
        MovePose(pose,
                 std::span<const double>(step.data(), static_cast<std::size_t>(step.size()))));
    double sum = 0;
    PointJacobian unused;
    for (const auto& list : matches) {
      for (const Match& m : list) {
        const Vec3d x = SkinVertexJacobian(body, d, m.vertex, unused);
        const double r = static_cast<double>(m.residual) +
                         m.gradient.cast<double>().dot(
                             x - at[static_cast<std::size_t>(m.vertex)].cast<double>());
        sum += 0.5 * static_cast<double>(m.length * RobustWeight(m.residual, scale)) * r * r;
      }
    }
    return sum / (0.015 * 0.015 * 0.1);
  };
  const Eigen::Index n = system.gradient.size();
  const double h = 1e-5;
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    step[k] = h;
    const double up = cost(step);
    step[k] = -h;
    EXPECT_NEAR((up - cost(step)) / (2 * h), system.gradient[k], 2e-3 * system.gradient.norm())
        << "unknown " << k;
  }
  EXPECT_LT((system.matrix - system.matrix.transpose()).norm(), 1e-6 * system.matrix.norm());
}

TEST(BodyView, CoversWhatTheRasterizerCovers) {
  const Actor& body = SmallBody();
  const Pose pose = SomePose(body.skeleton);
  const std::vector<Camera> cameras = RingOfCameras(3, 200);
  const SilhouetteSet set = DrawSilhouettes(cameras, body, {pose});
  const Observation observation = ObserveFrame(set, 0);
  const TrackedBody tracked = MakeTrackedBody(body);
  PoseEvaluator evaluator(observation, tracked);
  const PoseState state = evaluator.Evaluate(pose);
  ASSERT_EQ(state.overlaps.size(), 3U);
  // The field is slightly smoothed; apart from fingers the two agree.
  for (const Overlap& o : state.overlaps) EXPECT_GT(o.Iou(), 0.97F);
  // At the truth no match pulls far.
  for (const auto& list : evaluator.Matches(state, 0.2F)) {
    ASSERT_GT(list.size(), 100U);
    int far = 0;
    for (const Match& m : list) far += std::abs(m.residual) > 0.02F ? 1 : 0;
    EXPECT_LT(far, static_cast<int>(list.size()) / 20);
  }
}

TEST(SolvePose, RecoversAPerturbedPose) {
  const Actor& body = SmallBody();
  const Pose truth = SomePose(body.skeleton);
  const SilhouetteSet set = DrawSilhouettes(RingOfCameras(7, 240), body, {truth});
  const Observation observation = ObserveFrame(set, 0);
  const TrackedBody tracked = MakeTrackedBody(body);
  Pose start = truth;
  Random random(11);
  start.root_translation += Vec3d(0.05, -0.04, 0.03);
  start.root_rotation = Quatd(Eigen::AngleAxisd(0.15, Vec3d::UnitZ())) * start.root_rotation;
  for (double& a : start.angles) a += 0.12 * static_cast<double>(random.Normal());
  start = ClampToLimits(body.skeleton, start);
  const auto solve = [&] {
    PoseEvaluator evaluator(observation, tracked);
    return SolvePose(evaluator, start, start);
  };
  SetJobs(1);
  const PoseSolution one = solve();
  SetJobs(0);
  const PoseSolution two = solve();
  EXPECT_EQ(one.pose.angles, two.pose.angles);  // threads change nothing
  EXPECT_GT(one.iou, 0.955);
  const JointError error = CompareJoints(body.skeleton, truth, body.skeleton, one.pose);
  EXPECT_LT(error.mean, 0.012);
  EXPECT_LT(error.most, 0.035);
  const Pose limited = ClampToLimits(body.skeleton, one.pose);
  EXPECT_EQ(limited.angles, one.pose.angles);
}

TEST(SearchLimb, FindsAnArmThatIsElsewhere) {
  const Actor& body = SmallBody();
  Pose truth = SomePose(body.skeleton);
  Angle(body.skeleton, truth, "r_shoulder_elevation") = 1.9;
  Angle(body.skeleton, truth, "r_elbow_flexion") = 1.0;
  Pose start = truth;
  Angle(body.skeleton, start, "r_shoulder_elevation") = -0.6;
  Angle(body.skeleton, start, "r_elbow_flexion") = 0.1;
  const SilhouetteSet set = DrawSilhouettes(RingOfCameras(7, 200), body, {truth});
  const Observation observation = ObserveFrame(set, 0);
  const TrackedBody tracked = MakeTrackedBody(body);
  PoseEvaluator evaluator(observation, tracked);
  const std::vector<Limb> limbs = FindLimbs(tracked.actor);
  ASSERT_EQ(limbs.size(), 4U);
  const Limb& arm = limbs[2];
  ASSERT_EQ(arm.name, "r_arm");
  EXPECT_GT(MeasureLimb(evaluator, start, arm).outside, 0.2);
  EXPECT_LT(MeasureLimb(evaluator, truth, arm).outside, 0.1);
  const auto candidates = SearchLimb(evaluator, start, arm, 2);
  const PoseSolution found = SolvePose(evaluator, candidates[0].pose, candidates[0].pose);
  EXPECT_LT(CompareJoints(body.skeleton, truth, body.skeleton, found.pose).most, 0.05);
}

}  // namespace
}  // namespace dyxel::internal
