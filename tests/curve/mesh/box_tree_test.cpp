#include "libcurve/mesh/detail/box_tree.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "libcurve/mesh/primitives.h"

namespace surf::curve {
namespace {

/// Circles here and there, rows in a random order.
Segments some_curves(unsigned seed, int n_circles) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3, 3), radius(0.2, 1.5);
  std::vector<Segments> parts;
  for (int n = 0; n < n_circles; ++n)
    parts.push_back(circle({place(random), place(random)}, radius(random), 0.2));
  Segments out = joined(parts);
  std::vector<int> rows(out.elements.rows());
  std::iota(rows.begin(), rows.end(), 0);
  std::shuffle(rows.begin(), rows.end(), random);
  out.elements = Elements<2>(out.elements(rows, Eigen::all));
  return out;
}

Box box_of(const Segments& curves, int e, double margin) {
  const auto a = curves.points.row(curves.elements(e, 0)),
             b = curves.points.row(curves.elements(e, 1));
  return {std::min(a[0], b[0]) - margin, std::min(a[1], b[1]) - margin, std::max(a[0], b[0]),
          std::max(a[1], b[1])};
}

TEST(BoxTree, OrderIsAPermutationThatFollowsTheCurves) {
  for (const int n_circles : {1, 3, 20}) {
    const Segments curves = some_curves(1, n_circles);
    const std::vector<int> order = order_along_curves(curves.points, curves.elements);
    EXPECT_EQ(std::set<int>(order.begin(), order.end()).size(), order.size());
    ASSERT_EQ(Eigen::Index(order.size()), curves.elements.rows());
    int n_breaks = 0;
    for (std::size_t k = 1; k < order.size(); ++k)
      n_breaks += curves.elements(order[k], 0) != curves.elements(order[k - 1], 1);
    EXPECT_EQ(n_breaks, n_circles - 1);
  }
}

TEST(BoxTree, FindsThePairsWhoseBoxesMeetOnceEach) {
  for (const double margin : {0.0, 0.15}) {
    const Segments curves = some_curves(2, 12);
    std::set<std::pair<int, int>> expected;
    const int n = int(curves.elements.rows());
    for (int e = 0; e < n; ++e)
      for (int f = e + 1; f < n; ++f)
        if (box_of(curves, e, margin).meets(box_of(curves, f, margin))) expected.emplace(e, f);
    std::set<std::pair<int, int>> found;
    int n_found = 0;
    BoxTree(curves.points, curves.elements, margin).for_each_pair([&](int e, int f) {
      found.insert(std::minmax(e, f));
      ++n_found;
    });
    EXPECT_EQ(found, expected);
    EXPECT_EQ(n_found, int(expected.size()));
  }
}

TEST(BoxTree, FindsTheNearestElement) {
  const Segments curves = some_curves(3, 12);
  const BoxTree tree(curves.points, curves.elements, 0);
  const auto squared = [&](int e, const Vector<2>& p) {
    const Vector<2> a = curves.points.row(curves.elements(e, 0)),
                    b = curves.points.row(curves.elements(e, 1));
    const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    return (p - a - t * (b - a)).squaredNorm();
  };
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-5, 5);
  std::size_t n_visited = 0;
  for (int n = 0; n < 100; ++n) {
    const Vector<2> p(place(random), place(random));
    double expected = std::numeric_limits<double>::infinity(), nearest = expected;
    for (int e = 0; e < curves.elements.rows(); ++e) expected = std::min(expected, squared(e, p));
    tree.for_each_near(p, nearest, [&](int e) {
      ++n_visited;
      return nearest = std::min(nearest, squared(e, p));
    });
    EXPECT_EQ(nearest, expected);
    // Nothing within a bound that is smaller.
    tree.for_each_near(p, 0.5 * expected, [&](int e) {
      EXPECT_GE(squared(e, p), expected);
      return 0.5 * expected;
    });
  }
  EXPECT_LT(n_visited, 100u * curves.elements.rows() / 4);
}

TEST(BoxTree, OfNothingFindsNothing) {
  const BoxTree tree(Points<2>(0, 2), Elements<2>(0, 2), 0);
  tree.for_each_pair([](int, int) { ADD_FAILURE(); });
  tree.for_each_near({0, 0}, 1e9, [](int) {
    ADD_FAILURE();
    return 0.0;
  });
}

TEST(Box, DistanceIsThatToItsNearestPoint) {
  const Box box{0, 0, 2, 1};
  EXPECT_EQ(box.squared_distance({1, 0.5}), 0);
  EXPECT_EQ(box.squared_distance({2, 1}), 0);
  EXPECT_EQ(box.squared_distance({5, 5}), 9 + 16);
  EXPECT_EQ(box.squared_distance({-3, 0.5}), 9);
  EXPECT_TRUE(box.meets({2, 1, 3, 3}));
  EXPECT_FALSE(box.meets({2.1, 0, 3, 1}));
}

}  // namespace
}  // namespace surf::curve
