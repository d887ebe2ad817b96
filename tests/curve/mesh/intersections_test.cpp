#include "libcurve/mesh/intersections.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <numbers>
#include <random>

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;

Kernel::Segment_2 segment(const Segments& s, int e) {
  const auto point = [&](int i) { return Kernel::Point_2(s.points(i, 0), s.points(i, 1)); };
  return {point(s.elements(e, 0)), point(s.elements(e, 1))};
}

/// The definition, pair by pair, by exact constructions.
std::vector<ElementPair> by_definition(const Segments& s) {
  std::vector<ElementPair> out;
  const int n = static_cast<int>(s.elements.rows());
  for (int e = 0; e < n; ++e)
    for (int f = e + 1; f < n; ++f) {
      int n_shared = 0;
      for (const int i : s.elements.row(e))
        for (const int j : s.elements.row(f)) n_shared += i == j;
      const auto common = CGAL::intersection(segment(s, e), segment(s, f));
      if (!common) continue;
      const auto* overlap = boost::get<Kernel::Segment_2>(&*common);
      if (n_shared == 0 || (overlap && !overlap->is_degenerate())) out.emplace_back(e, f);
    }
  return out;
}

void expect_those_of_the_definition(const Segments& s, const char* what) {
  const auto expected = by_definition(s);
  EXPECT_EQ(intersections(s.points, s.elements), expected) << what;
}

/// Random segments with ends on an n x n grid, some of which share nodes.
Segments random_soup(unsigned seed, int n_elements, int n_grid) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> coordinate(0, n_grid - 1);
  Segments out{Points<2>(2 * n_elements, 2), Elements<2>(n_elements, 2)};
  for (double& value : out.points.reshaped()) value = coordinate(random);
  std::uniform_int_distribution<int> node(0, 2 * n_elements - 1);
  for (int e = 0; e < n_elements; ++e) {
    out.elements.row(e) << 2 * e, 2 * e + 1;
    if (e % 3 == 0) out.elements(e, 0) = node(random);
  }
  return out;
}

TEST(Intersections, OfRandomSoupsOnCoarseGridsAreThoseOfTheDefinition) {
  // On coarse grids nearly everything is vertical, collinear, overlapping, touching or a point.
  for (unsigned seed = 0; seed < 400; ++seed)
    expect_those_of_the_definition(random_soup(seed, 3 + int(seed) % 40, 3 + int(seed) % 7),
                                   ("seed " + std::to_string(seed)).c_str());
}

TEST(Intersections, OfRandomSoupsOnFineGridsAreThoseOfTheDefinition) {
  for (unsigned seed = 0; seed < 40; ++seed)
    expect_those_of_the_definition(random_soup(seed, 150, 1 << (4 + seed % 20)),
                                   ("seed " + std::to_string(seed)).c_str());
}

TEST(Intersections, OfRandomPolygonsAreThoseOfTheDefinition) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int n = 3; n < 60; ++n) {
    Points<2> corners(n, 2);
    for (double& value : corners.reshaped()) value = normal(random);
    expect_those_of_the_definition(polygon(corners, 100), "polygon");
    // Rounded: nodes on elements, several crossings in one point.
    corners = (3 * corners.array()).round();
    expect_those_of_the_definition(polygon(corners, 100), "rounded polygon");
  }
}

TEST(Intersections, DoNotDependOnTheOrderOfTheElements) {
  Segments s = joined({circle({0, 0}, 1, 0.02), circle({1.5, 0.1}, 1, 0.015)});
  const auto expected = intersections(s.points, s.elements);
  ASSERT_EQ(expected.size(), 2u);
  std::vector<int> order(s.elements.rows());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = int(i);
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  const Elements<2> shuffled = s.elements(order, Eigen::all);
  std::vector<ElementPair> found;
  for (const auto& [e, f] : intersections(s.points, shuffled))
    found.push_back(std::minmax(order[e], order[f]));
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, expected);
}

TEST(Intersections, OfFlaggedElementsOnlyAreASubset) {
  const Segments s = joined({circle({0, 0}, 1, 0.1), circle({1.5, 0}, 1, 0.1)});
  const auto all = intersections(s.points, s.elements);
  std::vector<char> flagged(s.elements.rows(), 0);
  EXPECT_TRUE(intersections(s.points, s.elements, flagged).empty());
  flagged[all[0].second] = 1;
  for (const auto& pair : intersections(s.points, s.elements, flagged))
    EXPECT_EQ(pair.second, all[0].second);
}

TEST(Intersections, NeighboursThatFoldBackMeetAndOthersDoNot) {
  Segments s{Points<2>(3, 2), Elements<2>(2, 2)};
  s.elements << 0, 1, 1, 2;
  s.points << 0, 0, 1, 0, 2, 0;
  expect_those_of_the_definition(s, "straight on");
  EXPECT_TRUE(intersections(s.points, s.elements).empty());
  s.points << 0, 0, 1, 1, 0.5, 0.5;
  expect_those_of_the_definition(s, "folded back");
  EXPECT_EQ(intersections(s.points, s.elements).size(), 1u);
}

TEST(Intersections, NearPairsAreThoseWithinTheDistance) {
  const Segments s = joined({circle({0, 0}, 1, 0.1), circle({2.2, 0}, 1, 0.1)});
  EXPECT_FALSE(near_pairs(s.points, s.elements, 0.25).empty());
  const int n_first = static_cast<int>(circle({0, 0}, 1, 0.1).elements.rows());
  for (const auto& [e, f] : near_pairs(s.points, s.elements, 0.15))
    EXPECT_EQ(e < n_first, f < n_first);
}

TEST(Intersections, RefuseMissingPoints) {
  Segments s{Points<2>::Zero(2, 2), Elements<2>(1, 2)};
  s.elements << 0, 2;
  EXPECT_THROW(intersections(s.points, s.elements), InvalidMesh);
  s.elements << 0, 1;
  s.points(1, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(intersections(s.points, s.elements), InvalidMesh);
}

}  // namespace
}  // namespace surf::curve
