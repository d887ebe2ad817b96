#include "libsurf/volume/phantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/measure.h"

namespace surf::volume {
namespace {

using Eigen::Vector3d;

constexpr PhantomKind kAll[] = {
    PhantomKind::kBall,  PhantomKind::kTwoBalls, PhantomKind::kBox,
    PhantomKind::kTorus, PhantomKind::kVessel,   PhantomKind::kSeparateBalls,
    PhantomKind::kShell, PhantomKind::kTree,     PhantomKind::kRods};

TEST(Phantom, DistancesAreThoseOfTheBodies) {
  constexpr double kRounding = 1e-15;
  EXPECT_NEAR(phantom_distance(PhantomKind::kBall, {0, 0.9, 0}), 0.3, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kTwoBalls, {0, 0, 0}), 0, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kTwoBalls, {-0.4, 0, 0.1}), -0.3, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kBox, {0, 0, 0}), -0.3, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kBox, {0.9, 0.8, 0}), 0.5, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kTorus, {0, -0.5, 0.05}), -0.15, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kTorus, {0, 0, 0}), 0.3, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kVessel, {0, 0, -0.6}), -0.14, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kSeparateBalls, {0, 0, 0}), 0.2, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kSeparateBalls, {-0.5, 0.1, 0}), -0.2, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kShell, {0, 0, 0}), 0.3, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kShell, {0, -0.5, 0}), -0.1, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kShell, {0, 0, 0.7}), 0.1, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kTree, {0, 0, -0.6}), -0.15, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kTree, {-0.65, -0.1, 0.05}), -0.1, kRounding);
  EXPECT_NEAR(phantom_distance(PhantomKind::kRods, {0, 0.9, 0}), 0.3, kRounding);
}

TEST(Phantom, RodsAreBoredThroughTheBallWithoutMeeting) {
  constexpr double kRounding = 1e-12;
  for (const Capsule& rod : rod_capsules()) {
    EXPECT_NEAR(rod.start.norm(), 0.66, kRounding);
    EXPECT_NEAR(rod.end.norm(), 0.66, kRounding);
    for (int n = 0; n <= 400; ++n) {
      const Vector3d p = rod.start + n / 400.0 * (rod.end - rod.start);
      if (p.norm() < 0.55) {
        EXPECT_NEAR(phantom_distance(PhantomKind::kRods, p), rod.radius, kRounding);
      }
      for (const Capsule& other : rod_capsules()) {
        if (&other == &rod) continue;
        const Vector3d axis = (other.end - other.start).normalized();
        const double at = std::clamp((p - other.start).dot(axis), 0.0, 1.32);
        EXPECT_GT((p - other.start - std::min(at, (other.end - other.start).norm()) * axis).norm(),
                  0.07 - kRounding);
      }
    }
  }
}

/// Labels of the body, and the measures of the surfaces between them and the rest.
std::vector<mesh::ComponentMeasures> components(PhantomKind kind, int size) {
  std::vector<float> labels;
  const double step = 2.0 / (size - 1);
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i)
        labels.push_back(
            phantom_distance(kind, Vector3d(i * step - 1, j * step - 1, k * step - 1)) < 0);
  const Eigen::Affine3d affine = Eigen::Translation3d(-1, -1, -1) * Eigen::Scaling(step);
  const auto surface = mesh::surface_of_label_map(Volume({size, size, size}, affine, labels));
  return mesh::measure_components(surface);
}

TEST(Phantom, BodiesHaveTheirTopology) {
  using Kind = PhantomKind;
  const auto expect = [](Kind kind, int size, std::vector<int> genus) {
    const auto found = components(kind, size);
    ASSERT_EQ(found.size(), genus.size()) << int(kind);
    for (std::size_t n = 0; n < genus.size(); ++n)
      EXPECT_EQ(found[n].genus(), genus[n]) << int(kind);
  };
  expect(Kind::kBall, 40, {0});
  expect(Kind::kBox, 40, {0});
  expect(Kind::kTorus, 40, {1});
  expect(Kind::kSeparateBalls, 40, {0, 0});
  expect(Kind::kShell, 40, {0, 0});
  expect(Kind::kVessel, 64, {0});
  expect(Kind::kTree, 64, {0});
  expect(Kind::kRods, 128, {40});  // finer grids find the sharp rims of the rods in single voxels
  EXPECT_LT(components(Kind::kShell, 40)[1].volume_mm3, 0);
}

// Where it is smooth the distance grows by the length of the step along its gradient; that
// holds at almost all points near a surface.
TEST(Phantom, DistancesHaveUnitSlopeNearTheSurface) {
  constexpr double kStep = 1e-5, kTolerance = 1e-4;
  for (const PhantomKind kind : kAll) {
    int n_near = 0, n_unit = 0;
    for (int n = 0; n < 400000; ++n) {
      const Vector3d p(std::sin(1.0 * n), std::sin(1.7 * n), std::sin(2.3 * n));
      const double d = phantom_distance(kind, p);
      if (std::abs(d) > 0.01) continue;
      Vector3d gradient;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d step = kStep * Vector3d::Unit(axis);
        gradient[axis] =
            (phantom_distance(kind, p + step) - phantom_distance(kind, p - step)) / (2 * kStep);
      }
      ++n_near;
      n_unit += std::abs(gradient.norm() - 1) < kTolerance;
    }
    EXPECT_GT(n_near, 300) << int(kind);
    EXPECT_GT(n_unit, 0.99 * n_near) << int(kind);
  }
}

TEST(Phantom, DistancesChangeNoFasterThanThePointMoves) {
  constexpr double kRounding = 1e-12;
  for (const PhantomKind kind : kAll)
    for (int n = 0; n < 2000; ++n) {
      const Vector3d p(std::sin(1.0 * n), std::sin(1.7 * n), std::sin(2.3 * n));
      const Vector3d q =
          p + 0.05 * Vector3d(std::cos(3.1 * n), std::cos(0.7 * n), std::cos(5.0 * n));
      EXPECT_LE(std::abs(phantom_distance(kind, p) - phantom_distance(kind, q)),
                (p - q).norm() + kRounding);
    }
}

TEST(Phantom, EveryBodyLiesInTheUnitBallWithAMargin) {
  for (const PhantomKind kind : kAll)
    for (int n = 1; n < 5000; ++n) {
      const Vector3d p =
          Vector3d(std::sin(1.0 * n), std::sin(1.7 * n), std::sin(2.3 * n)).normalized();
      EXPECT_GT(phantom_distance(kind, p), 0.05);
    }
}

TEST(Phantom, ValuesFollowTheProfileOfTheDistance) {
  PhantomOptions options;
  options.size = {33, 33, 33};
  const Volume volume = make_phantom(options);
  EXPECT_TRUE(volume.index_to_world() * Vector3d(0, 0, 0) == Vector3d(-1, -1, -1));
  EXPECT_NEAR(volume.spacing()[0], 2.0 / 32, 1e-15);
  constexpr double kFloatRounding = 6e-8;
  for (int i = 0; i < 33; ++i) {
    const double d = std::abs(-1 + i / 16.0) - 0.6;
    const double t = std::clamp(-d / 0.05, -1.0, 1.0);
    const double expected = (1 + t + std::sin(std::numbers::pi * t) / std::numbers::pi) / 2;
    EXPECT_NEAR(volume.value(i, 16, 16), expected, kFloatRounding);
  }
}

TEST(Phantom, BodyKeepsItsPlaceInTheWorldWhenTheGridTurns) {
  PhantomOptions straight;
  straight.kind = PhantomKind::kBox;
  straight.size = {24, 24, 24};
  straight.spacing_mm = Vector3d(2, 2, 2);
  straight.origin_ras_mm = Vector3d(5, 6, 7);
  PhantomOptions turned = straight;  // i to I, j to L, k to A: the same nodes in another order
  turned.direction << 0, -1, 0, 0, 0, 1, -1, 0, 0;
  turned.origin_ras_mm = Vector3d(5 + 46, 6, 7 + 46);
  const Volume a = make_phantom(straight), b = make_phantom(turned);
  constexpr float kFloatRounding = 2e-6f;
  for (int n = 0; n < 24; ++n)
    for (int m = 0; m < 24; ++m)
      for (int l = 0; l < 24; ++l)
        ASSERT_NEAR(a.value(l, m, n), b.value(23 - n, 23 - l, m), kFloatRounding);
}

TEST(Phantom, GrowsWithTheSpacingOfTheShortestSide) {
  PhantomOptions options;
  options.size = {41, 31, 21};
  options.spacing_mm = Vector3d(1, 1, 2);
  EXPECT_NEAR(options.unit_mm(), 15, 1e-12);
  const Vector3d center = options.center_ras_mm();
  EXPECT_NEAR(phantom_distance_mm(options, center + Vector3d(0, 0, 12)), 12 - 9, 1e-12);
}

TEST(Phantom, NoiseHasItsDeviationAndFollowsTheSeedOnly) {
  PhantomOptions options;
  options.size = {40, 40, 40};
  options.noise = 0.1;
  const Volume noisy = make_phantom(options), again = make_phantom(options);
  options.random_seed = 1;
  const Volume other = make_phantom(options);
  options.noise = 0;
  const Volume clean = make_phantom(options);
  double sum = 0, sum_squares = 0, product = 0;
  int n_same = 0;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) {
        ASSERT_EQ(noisy.value(i, j, k), again.value(i, j, k));
        n_same += noisy.value(i, j, k) == other.value(i, j, k);
        const double e = noisy.value(i, j, k) - clean.value(i, j, k);
        const double f = other.value(i, j, k) - clean.value(i, j, k);
        sum += e;
        sum_squares += e * e;
        product += e * f;
      }
  const double n = 40.0 * 40 * 40;
  const double kFiveDeviations = 5 / std::sqrt(n);
  EXPECT_NEAR(sum / n, 0, 0.1 * kFiveDeviations);
  EXPECT_NEAR(std::sqrt(sum_squares / n), 0.1, 0.1 * kFiveDeviations);
  EXPECT_NEAR(product / n, 0, 0.01 * kFiveDeviations);
  EXPECT_LT(n_same, 10);
}

TEST(Phantom, InvalidOptionsAreRefusedByName) {
  PhantomOptions options;
  options.size = {128, 1, 128};
  EXPECT_THROW(make_phantom(options), UsageError);
  options = {};
  options.noise = std::nan("");
  EXPECT_NE(options.error().find("PhantomOptions::noise"), std::string::npos);
  options = {};
  options.direction.setZero();
  EXPECT_NE(options.error().find("PhantomOptions::direction"), std::string::npos);
  options = {};
  options.edge_width_mm = 0;
  EXPECT_NE(options.error().find("PhantomOptions::edge_width_mm"), std::string::npos);
  options = {};
  options.spacing_mm = Vector3d(1, -1, 1);
  EXPECT_NE(options.error().find("PhantomOptions::spacing_mm"), std::string::npos);
}

}  // namespace
}  // namespace surf::volume
