#include "libsurf/segment/detail/change.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/surf/fixtures.h"

namespace surf::segment {
namespace {

template <class T>
struct Change : ::testing::Test {
  static constexpr int kDim = T::value;
  static NodeBox<kDim> box() { return NodeBox<kDim>::cube(0, 20); }
  /// Of the first coordinate, the others between 5 and 14.
  static NodeSet<kDim> bar(const std::function<bool(int)>& is_in) {
    Flags out(box().n());
    for (std::size_t at = 0; at < out.size(); ++at) {
      const auto node = box().node(at);
      out[at] = is_in(node[0]);
      for (int axis = 1; axis < kDim; ++axis) out[at] &= node[axis] >= 5 && node[axis] < 15;
    }
    return {box(), out};
  }
  static NodeSet<kDim> all() { return NodeSet<kDim>(box()).complement(); }
  static NodeSet<kDim> none() { return NodeSet<kDim>(box()); }
  static std::vector<std::uint16_t> levels(int inner, int outer) {
    const Flags inside = bar([](int x) { return x >= 3 && x < 13; }).flags();
    std::vector<std::uint16_t> out(inside.size());
    for (std::size_t at = 0; at < out.size(); ++at)
      out[at] = std::uint16_t(inside[at] ? inner : outer);
    return out;
  }
  /// Of a bar from 3 to 12 of which 3 to 7 was known.
  static ChangeFeatures addition(int inner_level, int outer_level, const NodeSet<kDim>& edge) {
    const NodeSet<kDim> piece = bar([](int x) { return x >= 8 && x < 13; }),
                        before = bar([](int x) { return x >= 3 && x < 8; });
    return measure_change(box(), piece, before, Side::kInside, levels(inner_level, outer_level),
                          edge);
  }
  static double section() { return std::pow(10, kDim - 1); }
  static double side() { return 2 * (kDim - 1) * std::pow(10, kDim - 2); }
};
TYPED_TEST_SUITE(Change, test::Dims, test::DimName);

TYPED_TEST(Change, CountsTheNewBoundaryOfAnAddition) {
  const ChangeFeatures f = this->addition(1000, 10, this->all());
  EXPECT_EQ(f.n_nodes, 5 * this->section());
  EXPECT_EQ(f.n_free, this->section() + 5 * this->side());
  EXPECT_EQ(f.n_faces, f.n_free + this->section());
  EXPECT_EQ(f.n_free_on_edge, f.n_free);
  EXPECT_EQ(f.n_border, 0);
  EXPECT_NEAR(f.separation, 1, 1e-12);
  EXPECT_NEAR(f.score(Side::kInside), (f.n_free + 0.5) / (f.n_free + 1), 1e-12);
}

// What is alike beyond its free faces is no object of its own.
TYPED_TEST(Change, SeparatesAnAdditionFromWhatLiesBeyond) {
  const ChangeFeatures f = this->addition(500, 500, this->none());
  EXPECT_EQ(f.separation, 0);
  EXPECT_EQ(f.n_free_on_edge, 0);
  EXPECT_EQ(f.score(Side::kInside), 0);
}

// What was too much is alike: only the length of the cut off edges counts.
TYPED_TEST(Change, JudgesARemovalByItsCut) {
  const auto box = this->box();
  const auto piece = this->bar([](int x) { return x >= 8 && x < 13; }),
             before = this->bar([](int x) { return x >= 3 && x < 13; });
  const auto level = this->levels(1000, 10);
  const ChangeFeatures off =
      measure_change(box, piece, before, Side::kOutside, level, this->none());
  EXPECT_EQ(off.n_free, this->section());  // to what stays
  EXPECT_EQ(off.separation, 0);
  const double share = off.n_free / off.n_faces;
  EXPECT_NEAR(off.score(Side::kOutside), (1 - share) * (1 - share) * std::pow(0.6, 1.3), 1e-12);
  const ChangeFeatures on = measure_change(box, piece, before, Side::kOutside, level, this->all());
  EXPECT_GT(on.score(Side::kOutside), off.score(Side::kOutside));
}

TYPED_TEST(Change, CountsTheBorderOfTheBox) {
  const auto piece = this->bar([](int x) { return x < 4; });
  const ChangeFeatures f = measure_change(this->box(), piece, this->none(), Side::kInside,
                                          this->levels(9, 9), this->none());
  EXPECT_EQ(f.n_border, this->section());
}

TYPED_TEST(Change, FindsTheLargestComponent) {
  EXPECT_EQ(largest_component(this->bar([](int x) { return x < 2 || (x > 4 && x < 9); })),
            std::size_t(4 * this->section()));
  EXPECT_EQ(largest_component(this->none()), 0u);
}

TYPED_TEST(Change, MeasuresDepthsToTheOutsideAndTheBorder) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  const NodeSet<Dim> inside = this->bar([](int) { return true; });
  typename NodeBox<Dim>::Index node;
  node.fill(7);  // 2 nodes from the ones that are 5: 3 from what is outside
  std::vector<typename NodeBox<Dim>::Index> nodes = {node};
  const Depths d = depths_of<Dim>(box, inside, nodes);
  EXPECT_NEAR(d.at_nodes, 3, 1e-6);
  EXPECT_NEAR(d.greatest, 5, 1e-6);
  EXPECT_NEAR(d.share(), 3.7 / 5, 1e-6);
  EXPECT_EQ(d.share(0.5), 1);
  nodes[0][0] = 0;
  EXPECT_NEAR(depths_of<Dim>(box, inside, nodes).at_nodes, 1, 1e-6);  // the border
}

// In a bar and in a large ball, deep inside and near the outside.
TYPED_TEST(Change, BoundsTheShareOfADepth) {
  constexpr int Dim = TypeParam::value;
  const auto box = NodeBox<Dim>::cube(0, 50);
  const auto ball = NodeSet<Dim>::where(box, [&](std::size_t at) {
    double sum = 0;
    for (const int i : box.node(at)) sum += (i - 24) * (i - 24);
    return sum <= 22 * 22;
  });
  for (const NodeSet<Dim>& inside : {ball, this->bar([](int) { return true; })}) {
    double tightest = 1;
    for (int x = 3; x < 48; ++x) {
      typename NodeBox<Dim>::Index node;
      node.fill(Dim == 3 ? 14 : 10);
      node[0] = x;
      if (!inside.box().contains(node) || !inside.contains(node)) continue;
      const std::vector<typename NodeBox<Dim>::Index> nodes = {node};
      const double share = depths_of<Dim>(inside.box(), inside, nodes).share();
      EXPECT_GE(most_share<Dim>(inside, nodes), share);
      tightest = std::min(tightest, most_share<Dim>(inside, nodes));
    }
    EXPECT_LT(tightest, inside.box().n() == box.n() ? 0.3 : 1.1);
  }
}

}  // namespace
}  // namespace surf::segment
