#include "libsurf/segment/region_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>

#include "libsurf/base/threads.h"
#include "tests/surf/fixtures.h"
#include "tests/surf/segment/lattice_image.h"

namespace surf::segment {
namespace {

using test::image_of;
using test::LatticeImage;

constexpr double kNoise = 0.03;

template <int Dim>
bool is_in_ball(const Vector<Dim>& x, const Vector<Dim>& center, double radius) {
  return (x - center).norm() <= radius;
}

template <int Dim>
double radius_of_ball(double content) {
  return Dim == 2 ? std::sqrt(content / std::numbers::pi)
                  : std::cbrt(3 / (4 * std::numbers::pi) * content);
}

/// The widest window before the leak reaches to the foot of the edge.
constexpr double kEdge = 1;

template <int Dim>
std::vector<Region<Dim>> search(const LatticeImage<Dim>& image,
                                const std::vector<Vector<Dim>>& seeds,
                                const SearchOptions& options = {},
                                const SearchProgress<Dim>& progress = {},
                                const std::stop_token& stop = {}) {
  const SearchGrid<Dim> grid(image, image.extent(), {image.extent(), options.max_nodes});
  const SeedView<Dim> view(grid, seeds);
  std::vector<Region<Dim>> out;
  for (const Rung<Dim>& rung : search_rungs<Dim>(grid, seeds, options, progress, stop).found)
    out.push_back(region_of(view, rung));
  return out;
}

/// [mm^Dim], from the shares.
template <int Dim>
double content_of(const Region<Dim>& region) {
  return std::abs(region.node_to_world.linear().determinant()) *
         std::accumulate(region.share.begin(), region.share.end(), 0.0);
}

/// At the nearest node; 0 where the region's grid has ended.
template <int Dim>
double share_at(const Region<Dim>& region, const Vector<Dim>& point) {
  const Vector<Dim> index = region.node_to_world.inverse() * point;
  NodeBox<Dim> box;
  box.size = region.size;
  std::array<int, Dim> node;
  for (int axis = 0; axis < Dim; ++axis) node[axis] = int(std::lround(index[axis]));
  return box.contains(node) ? region.share[box.at(node)] : 0;
}

template <class T>
struct RegionSearch : ::testing::Test {
  static Vector<T::value> at(double x, double y, double z) {
    return Eigen::Vector3d(x, y, z).template head<T::value>();
  }
};
TYPED_TEST_SUITE(RegionSearch, test::Dims, test::DimName);

TYPED_TEST(RegionSearch, PutsTheObjectFirst) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(23, 25, 22);
  const auto regions = search<Dim>(
      image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(x, center, 14); }, kNoise),
      {center});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 14, kEdge);
  EXPECT_GT(share_at<Dim>(regions.front(), center + this->at(12, 0, 0)), 0.9);
  EXPECT_NEAR(regions.front().mean, 1, 2 * kNoise);
  EXPECT_GT(regions.front().features.separation, 0.9);
}

// Its depth ranks a region low, and makes it no less an object.
TYPED_TEST(RegionSearch, FindsWhatIsClickedNearItsEdge) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(24, 24, 24);
  const auto regions =
      search<Dim>(image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(x, center, 14); },
                                Dim == 2 ? 0.8 : 1.1),
                  {center + this->at(12, 0, 0)});
  ASSERT_FALSE(regions.empty());
  EXPECT_LT(regions.front().score, 0.4);
  EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 14, kEdge);
}

TYPED_TEST(RegionSearch, CutsNecksAndFillsHoles) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> left = this->at(12, 24, 24), right = this->at(36, 24, 24),
                    hole = this->at(12, 27, 24);
  const auto regions = search<Dim>(
      image_of<Dim>(
          [&](const Vector<Dim>& x) {
            if (is_in_ball<Dim>(x, hole, 1.5)) return 0.0;
            const double off_axis = (x - left).tail(Dim - 1).norm();
            const bool is_neck = x[0] > 12 && x[0] < 36 && off_axis < 1.6;
            return double(is_in_ball<Dim>(x, left, 9) || is_in_ball<Dim>(x, right, 9) || is_neck);
          },
          kNoise),
      {left});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 9, kEdge);
  EXPECT_GT(share_at<Dim>(regions.front(), hole), 0.9);
  EXPECT_LT(share_at<Dim>(regions.front(), right), 0.1);
}

TYPED_TEST(RegionSearch, FindsWhatTheScanCutsOff) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(0, 24, 24);
  const auto regions = search<Dim>(
      image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(x, center, 14); }, kNoise),
      {this->at(5, 24, 24)});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball<Dim>(2 * content_of(regions.front())), 14, kEdge);
}

TYPED_TEST(RegionSearch, OffersRegionsThatDiffer) {
  constexpr int Dim = TypeParam::value;
  // A ball in a shell in a larger ball.
  const Vector<Dim> center = this->at(24, 24, 24);
  const auto regions = search<Dim>(image_of<Dim>(
                                       [&](const Vector<Dim>& x) {
                                         const double r = (x - center).norm();
                                         return r < 8 ? 3.0 : r < 15 ? 2.0 : r < 21 ? 1.0 : -4.0;
                                       },
                                       kNoise),
                                   {center});
  ASSERT_GE(regions.size(), 2u);
  for (std::size_t i = 1; i < regions.size(); ++i) {
    EXPECT_GE(regions[i - 1].score, regions[i].score);
    for (std::size_t j = 0; j < i; ++j) {
      const double smaller = std::min(content_of(regions[i]), content_of(regions[j])),
                   larger = std::max(content_of(regions[i]), content_of(regions[j]));
      EXPECT_LE(2 * smaller / (smaller + larger), SearchOptions::kMostOverlap + 0.02);
    }
  }
}

TYPED_TEST(RegionSearch, TakesACoarserGridWhereItMust) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(23, 25, 22);
  const double max_nodes = std::pow(27, Dim);
  const auto regions = search<Dim>(
      image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(x, center, 16); }, kNoise),
      {center}, {.max_nodes = max_nodes});
  ASSERT_FALSE(regions.empty());
  const double node = regions.front().node_to_world.linear().col(0).norm();
  EXPECT_NEAR(regions.front().node_mm, 48.0 / 27, 1e-9);
  EXPECT_NEAR(node, regions.front().node_mm, 0.1);
  EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 16, node);
}

TYPED_TEST(RegionSearch, IsTheSameForAnyNumberOfThreads) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(23, 25, 22);
  const auto image =
      image_of<Dim>([&](const auto& x) { return std::cos(0.3 * (x - center).norm()); }, kNoise);
  std::vector<std::vector<Region<Dim>>> found;
  for (const int n : {1, 2}) {
    const ThreadLimit limit(n);
    found.push_back(search<Dim>(image, {center}));
  }
  ASSERT_FALSE(found[0].empty());
  ASSERT_EQ(found[0].size(), found[1].size());
  for (std::size_t i = 0; i < found[0].size(); ++i) {
    EXPECT_EQ(found[0][i].score, found[1][i].score);
    EXPECT_EQ(found[0][i].share, found[1][i].share);
  }
}

TYPED_TEST(RegionSearch, StopsOnRequestAndJudgesWhatItHas) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(24, 24, 24);
  const auto image =
      image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(x, center, 14); }, kNoise);
  const ThreadLimit limit(1);  // so that every window is told of
  int n_windows = 0, n_calls = 0;
  search<Dim>(image, {center}, {},
              [&](int n_done, const Rung<Dim>*) { return (n_windows = n_done) > 0; });
  ASSERT_GT(n_windows, 4);
  const auto stopped = search<Dim>(
      image, {center}, {}, [&](int, const Rung<Dim>*) { return ++n_calls < n_windows - 1; });
  EXPECT_FALSE(stopped.empty());
  EXPECT_EQ(n_calls, n_windows - 1);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(search<Dim>(image, {center}, {}, {}, stop.get_token()).empty());
}

TYPED_TEST(RegionSearch, TellsOfProgressOnTheCallersThread) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(24, 24, 24);
  const auto caller = std::this_thread::get_id();
  int n_calls = 0, n_seen = 0;
  search<Dim>(image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(x, center, 14); }, kNoise),
              {center}, {}, [&](int, const Rung<Dim>* seen) {
                EXPECT_TRUE(std::this_thread::get_id() == caller);
                n_seen += seen && seen->n_nodes > 0;
                return ++n_calls > 0;
              });
  EXPECT_GT(n_calls, n_seen);  // regions that settle are not shown
  EXPECT_GT(n_seen, 0);
}

TYPED_TEST(RegionSearch, TakesSeedsInObjectsOfDifferentIntensity) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> left = this->at(12, 24, 24), right = this->at(36, 24, 24);
  const auto regions = search<Dim>(
      image_of<Dim>(
          [&](const Vector<Dim>& x) {
            return is_in_ball<Dim>(x, left, 9) ? 3.0 : double(is_in_ball<Dim>(x, right, 9));
          },
          kNoise),
      {left, right});
  ASSERT_FALSE(regions.empty());
  for (const auto& inside : {left, right}) EXPECT_GT(share_at<Dim>(regions.front(), inside), 0.9);
  EXPECT_LT(share_at<Dim>(regions.front(), this->at(24, 40, 38)), 0.1);
}

TYPED_TEST(RegionSearch, KnowsTheShearOfAnImage) {
  constexpr int Dim = TypeParam::value;
  Eigen::Transform<double, Dim, Eigen::Affine> sheared;
  sheared.setIdentity();
  sheared(1, 0) = 0.45;
  const Vector<Dim> center = sheared * Vector<Dim>::Constant(24);
  const auto regions = search<Dim>(
      image_of<Dim>([&](const auto& x) { return is_in_ball<Dim>(sheared * x, center, 13); }, kNoise,
                    48, sheared),
      {center});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 13, kEdge);
}

TYPED_TEST(RegionSearch, FindsNothingWhereAllIsTheSame) {
  constexpr int Dim = TypeParam::value;
  EXPECT_TRUE(search<Dim>(image_of<Dim>([](const auto&) { return 3.0; }, 0, 20),
                          {Vector<Dim>::Constant(10)})
                  .empty());
  EXPECT_TRUE(search<Dim>(image_of<Dim>([](const auto& x) { return x[0]; }, 0, 2),
                          {Vector<Dim>::Constant(1)})
                  .empty());
}

TYPED_TEST(RegionSearch, FindsNothingInNoise) {
  constexpr int Dim = TypeParam::value;
  const auto noise = image_of<Dim>([](const auto&) { return 0.0; }, 1);
  for (const double at : {10.0, 24.0, 37.0}) {
    const auto found = search<Dim>(noise, {Vector<Dim>::Constant(at)});
    EXPECT_TRUE(found.empty()) << at << ": " << found.front().score << ", "
                               << found.front().features.enclosed;
  }
}

// A window's end lies up to two nodes off an edge that is as wide; a settled boundary on it.
TYPED_TEST(RegionSearch, SettlesOnTheEdge) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(24, 24, 24);
  const auto regions =
      search<Dim>(image_of<Dim>(
                      [&](const Vector<Dim>& x) {
                        return 1 / (1 + std::exp(((x - center).norm() - 12) / 0.8));
                      },
                      0.05),
                  {center});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 12, kEdge / 2);
}

/// A turned ellipsoid with a tail, and noise that belongs to the cell.
template <int Dim>
double scene(const Vector<Dim>& x) {
  Vector<Dim> from = x - Vector<Dim>::Constant(24);
  from[0] += 0.3 * from[1] + 2;
  from[1] *= 1.4;
  unsigned hash = 17;
  for (const double coordinate : x) hash = (hash ^ unsigned(coordinate)) * 1664525u + 1013904223u;
  const bool is_tail = std::abs(from[1]) < 2.5 && x[0] > 24;
  return double(from.norm() < 13 || is_tail) + 0.2 * ((hash >> 8) % 1000 / 1000.0 - 0.5);
}

TYPED_TEST(RegionSearch, TurnsWithTheHeader) {
  constexpr int Dim = TypeParam::value;
  Eigen::Transform<double, Dim, Eigen::Affine> turned;
  turned.setIdentity();
  for (int axis = 0; axis + 1 < Dim; ++axis) {
    const double c = std::cos(0.4 + axis), s = std::sin(0.4 + axis);
    Eigen::Matrix<double, Dim, Dim> step = Eigen::Matrix<double, Dim, Dim>::Identity();
    step(axis, axis) = step(axis + 1, axis + 1) = c;
    step(axis, axis + 1) = -s;
    step(axis + 1, axis) = s;
    turned.linear() = turned.linear() * step;
  }
  turned.linear() = (turned.linear() * 1e6).array().round() / 1e6;  // as files have it
  turned.translation().setConstant(-31.7);
  const Vector<Dim> seed = Vector<Dim>::Constant(25);
  const auto plain = search<Dim>(image_of<Dim>(scene<Dim>, 0), {seed});
  const auto found = search<Dim>(image_of<Dim>(scene<Dim>, 0, 48, turned), {turned * seed});
  ASSERT_FALSE(plain.empty());
  ASSERT_EQ(plain.size(), found.size());
  EXPECT_NEAR(content_of(found.front()) / content_of(plain.front()), 1, 1e-3);
}

TYPED_TEST(RegionSearch, FlipsAndPermutesWithTheAxes) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> seed = this->at(25, 23, 24.5);  // between two slices
  const auto plain = search<Dim>(image_of<Dim>(scene<Dim>, 0), {seed});
  ASSERT_FALSE(plain.empty());
  for (int change = 0; change < 2 * Dim; ++change) {
    // Of an index of the changed image, that of the plain one: an exchange of axes, or a flip.
    const auto to_plain = [&](const Vector<Dim>& x) -> Vector<Dim> {
      Vector<Dim> out = x;
      const int axis = change / 2;
      if (change % 2 == 0)
        out[axis] = 47 - out[axis];
      else
        std::swap(out[axis], out[(axis + 1) % Dim]);
      return out;
    };
    const auto found =
        search<Dim>(image_of<Dim>([&](const Vector<Dim>& x) { return scene<Dim>(to_plain(x)); }, 0),
                    {to_plain(seed)});  // its own inverse
    ASSERT_EQ(plain.size(), found.size()) << change;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      EXPECT_NEAR(content_of(found[i]) / content_of(plain[i]), 1, 1e-3) << change;
      EXPECT_NEAR(found[i].score, plain[i].score, 1e-3) << change;
    }
  }
}

TYPED_TEST(RegionSearch, IsTheSameForEverySeedInACell) {
  constexpr int Dim = TypeParam::value;
  const auto image = image_of<Dim>(scene<Dim>, 0);
  const Vector<Dim> seed = Vector<Dim>::Constant(25);
  const auto plain = search<Dim>(image, {seed});
  ASSERT_FALSE(plain.empty());
  for (int axis = 0; axis < Dim; ++axis)
    for (const double shift : {-0.4, 0.1}) {
      const auto moved = search<Dim>(image, {seed + shift * Vector<Dim>::Unit(axis)});
      ASSERT_FALSE(moved.empty());
      EXPECT_EQ(moved.front().share, plain.front().share);
    }
}

/// An edge that is so many cells wide (a logistic function of the depth) between 40 and 200.
template <int Dim>
double ball_with_edge(const Vector<Dim>& x, const Vector<Dim>& center, double radius,
                      double width) {
  return 40 + 160 / (1 + std::exp(((x - center).norm() - radius) / width));
}

// Of a clean image in whole numbers it ended where the intensity is first rounded down, at a sixth
// of the ball.
TYPED_TEST(RegionSearch, StepsOfRoundingAreNoEdges) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(23.3, 23.6, 23.9);
  for (const double width : {1.5, 2.0, 3.0}) {
    const auto image = image_of<Dim>(
        [&](const auto& x) { return std::round(ball_with_edge<Dim>(x, center, 15, width)); }, 0);
    ASSERT_EQ(image.extent().rounded_to, 1);
    const auto regions = search<Dim>(image, {center});
    ASSERT_FALSE(regions.empty()) << width;
    EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 15, kEdge) << width;
  }
}

// Windows grow evenly through it, so that no growth tells where it is.
TYPED_TEST(RegionSearch, FindsWhatHasAWideEdge) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(24, 23, 24);
  for (const double noise : {0.5, 1.0})
    for (const double width : {1.0, 1.5, 2.0}) {
      const auto regions = search<Dim>(
          image_of<Dim>([&](const auto& x) { return ball_with_edge<Dim>(x, center, 15, width); },
                        noise),
          {this->at(22, 25, 25)});
      ASSERT_FALSE(regions.empty()) << width << ' ' << noise;
      EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 15, kEdge)
          << width << ' ' << noise;
    }
}

TYPED_TEST(RegionSearch, SeesTheEdgesOfAMask) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = this->at(24, 23, 24);
  for (const double other : {1.0, 40.0}) {  // the highest label, far away
    const auto image = image_of<Dim>(
        [&](const auto& x) {
          return x.maxCoeff() < 3 ? other : double(is_in_ball<Dim>(x, center, 12));
        },
        0);
    ASSERT_EQ(image.extent().rounded_to, 0);
    const auto regions = search<Dim>(image, {center});
    ASSERT_FALSE(regions.empty()) << other;
    EXPECT_NEAR(radius_of_ball<Dim>(content_of(regions.front())), 12, kEdge) << other;
  }
}

TEST(RegionSearchInSpace, WorksOnTwoSlices) {
  std::vector<float> values;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 60; ++i)
        values.push_back(std::hypot(i - 30, j - 28) < 15 ? 1.f : float((i * 7 + j * 13) % 5) / 50);
  const LatticeImage<3> image({60, 60, 2}, Eigen::Affine3d::Identity(), values);
  const auto regions = search<3>(image, {Vector<3>(30, 28, 0.5)});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(std::sqrt(content_of(regions.front()) / (2 * std::numbers::pi)), 15, kEdge);
}

// Most of its boundary is where the volume ends.
TEST(RegionSearchInSpace, FindsADiscThroughSomeSlices) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  for (const int n_slices : {8, 10}) {
    std::vector<float> values;
    for (int k = 0; k < n_slices; ++k)
      for (int j = 0; j < 96; ++j)
        for (int i = 0; i < 96; ++i)
          values.push_back(float(std::hypot(i - 47.5, j - 47.5) < 28) + 0.05F * normal(random));
    const LatticeImage<3> image({96, 96, n_slices}, Eigen::Affine3d::Identity(), values);
    const auto regions = search<3>(image, {Vector<3>(48, 48, n_slices / 2)});
    ASSERT_FALSE(regions.empty()) << n_slices;
    EXPECT_NEAR(std::sqrt(content_of(regions.front()) / (n_slices * std::numbers::pi)), 28, kEdge);
  }
}

}  // namespace
}  // namespace surf::segment
