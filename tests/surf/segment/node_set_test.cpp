#include "libsurf/segment/node_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/surf/fixtures.h"

namespace surf::segment {
namespace {

/// Against what loops over all nodes say; rows of less and of more than one word.
template <class T>
struct NodeSets : ::testing::Test {
  static constexpr int kDim = T::value;
  using Index = typename NodeBox<kDim>::Index;

  static NodeBox<kDim> box(int row) {
    NodeBox<kDim> out;
    const std::array<int, 3> size = {row, 12, 9}, lower = {3, -2, 5};
    std::copy_n(size.begin(), kDim, out.size.begin());
    std::copy_n(lower.begin(), kDim, out.lower.begin());
    return out;
  }
  static std::vector<NodeBox<kDim>> boxes() { return {box(9), box(64), box(70), box(131)}; }
  /// One node in n.
  static Flags some(const NodeBox<kDim>& box, unsigned n, unsigned seed = 7) {
    unsigned state = seed;
    Flags out(box.n());
    for (auto& flag : out) {
      state = state * 1664525u + 1013904223u;
      flag = (state >> 8) % n == 0;
    }
    return out;
  }
  static int squared(const Index& a, const Index& b) {
    int out = 0;
    for (int axis = 0; axis < kDim; ++axis) out += (a[axis] - b[axis]) * (a[axis] - b[axis]);
    return out;
  }
  static Index middle(const NodeBox<kDim>& box) {
    Index out;
    for (int axis = 0; axis < kDim; ++axis) out[axis] = box.lower[axis] + box.size[axis] / 2;
    return out;
  }
  static Flags flood(const NodeBox<kDim>& box, const Flags& flags, std::size_t start) {
    Flags out(box.n());
    std::vector<std::size_t> front = {start};
    out[start] = 1;
    while (!front.empty()) {
      const std::size_t at = front.back();
      front.pop_back();
      box.for_neighbours(at, [&](std::size_t next) {
        if (!flags[next] || out[next]) return;
        out[next] = 1;
        front.push_back(next);
      });
    }
    return out;
  }
};
TYPED_TEST_SUITE(NodeSets, test::Dims, test::DimName);

TYPED_TEST(NodeSets, HoldTheNodesThatWereFlagged) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    const Flags flags = this->some(box, 3);
    const NodeSet<Dim> set(box, flags);
    EXPECT_EQ(set.flags(), flags);
    EXPECT_EQ(set.count(), std::size_t(std::count(flags.begin(), flags.end(), 1)));
    EXPECT_EQ(set.complement().count(), box.n() - set.count());
    for (std::size_t at = 0; at < box.n(); ++at)
      ASSERT_EQ(set.contains(box.node(at)), bool(flags[at]));
    auto beyond = box.lower;
    --beyond[0];
    EXPECT_FALSE(set.contains(beyond));
    NodeSet<Dim> other(box);
    EXPECT_TRUE(other.is_empty());
    set.for_each([&](std::size_t at) { other.insert(box.node(at)); });
    EXPECT_EQ(other, set);
    set.for_each([&](std::size_t at) { other.erase(box.node(at)); });
    EXPECT_TRUE(other.is_empty());
  }
}

TYPED_TEST(NodeSets, CombineNodeByNode) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    const Flags a = this->some(box, 2), b = this->some(box, 3, 11);
    const NodeSet<Dim> A(box, a), B(box, b);
    const Flags both = (A & B).flags(), any = (A | B).flags(), one = (A ^ B).flags(),
                less = (A - B).flags();
    for (std::size_t at = 0; at < box.n(); ++at) {
      ASSERT_EQ(both[at], a[at] && b[at]);
      ASSERT_EQ(any[at], a[at] || b[at]);
      ASSERT_EQ(one[at], a[at] != b[at]);
      ASSERT_EQ(less[at], a[at] && !b[at]);
    }
    EXPECT_EQ(A.count_in_both(B), (A & B).count());
  }
}

TYPED_TEST(NodeSets, KnowTheNextNodesAndTheFacesBetween) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    const Flags flags = this->some(box, 3);
    const NodeSet<Dim> set(box, flags);
    for (int axis = 0; axis < Dim; ++axis) {
      const Flags next = set.next_along(axis).flags(), previous = set.previous_along(axis).flags(),
                  faces = set.faces_along(axis).flags();
      std::size_t n_first = 0;
      box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
        const bool is_last = here + 1 == box.size[axis];
        ASSERT_EQ(next[at], !is_last && flags[at + stride]);
        ASSERT_EQ(previous[at], here > 0 && flags[at - stride]);
        ASSERT_EQ(faces[at], !is_last && flags[at] != flags[at + stride]);
        n_first += here == 0 && flags[at];
      });
      EXPECT_EQ(set.count_in_layer(axis, 0), n_first);
    }
  }
}

TYPED_TEST(NodeSets, LoseLayers) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes())
    for (int axis = 0; axis < Dim; ++axis) {
      NodeSet<Dim> set = NodeSet<Dim>(box).complement();
      set.erase_layers(axis, 2, 5);
      const Flags left = set.flags();
      box.for_lines(axis, [&](std::size_t at, int here, std::size_t) {
        ASSERT_EQ(left[at], here < 2 || here >= 5);
      });
    }
}

TYPED_TEST(NodeSets, AreSeenInOtherBoxes) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    const NodeSet<Dim> set(box, this->some(box, 3));
    for (const int by : {-70, -3, 0, 2, 67}) {
      NodeBox<Dim> other = box;
      other.lower[0] += by;
      other.lower[1] -= 1;
      other.size[0] += 4;
      const Flags found = set.in(other).flags();
      for (std::size_t at = 0; at < other.n(); ++at)
        ASSERT_EQ(found[at], set.contains(other.node(at))) << by;
    }
    const auto moved = set.moved_to({});
    EXPECT_EQ(moved.box().lower, typename NodeBox<Dim>::Index{});
    EXPECT_EQ(moved.flags(), set.flags());
  }
}

TYPED_TEST(NodeSets, GrowByABall) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    const NodeSet<Dim> set(box, this->some(box, 300));
    for (const double r : {0.0, 1.0, 1.5, 2.0, 3.5, 6.0}) {
      const Flags grown = set.dilated(r).flags();
      for (std::size_t at = 0; at < box.n(); ++at) {
        bool is_near = false;
        set.for_each([&](std::size_t other) {
          is_near |= this->squared(box.node(at), box.node(other)) <= r * r;
        });
        ASSERT_EQ(bool(grown[at]), is_near) << r;
      }
    }
  }
}

TYPED_TEST(NodeSets, FindWhatIsConnectedWithTheStarts) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes())
    for (const unsigned seed : {7u, 8u, 9u}) {
      Flags flags = this->some(box, 3, seed);
      for (auto& flag : flags) flag = !flag;  // two in three: winding ways
      const std::size_t start =
          std::size_t(std::find(flags.begin(), flags.end(), 1) - flags.begin());
      const NodeSet<Dim> set(box, flags);
      EXPECT_EQ(set.component({box.node(start)}).flags(), this->flood(box, flags, start));
      EXPECT_TRUE(set.component({}).is_empty());
    }
}

TYPED_TEST(NodeSets, FillWhatIsEnclosedAndNothingElse) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    const auto center = this->middle(box);
    const auto ball = NodeSet<Dim>::where(
        box, [&](std::size_t at) { return this->squared(box.node(at), center) <= 9; });
    const auto core = NodeSet<Dim>::where(
        box, [&](std::size_t at) { return this->squared(box.node(at), center) < 4; });
    EXPECT_EQ((ball - core).filled(), ball);
    // With a way out.
    NodeSet<Dim> open = ball - core;
    for (int i = 0; i <= 3; ++i) {
      auto node = center;
      node[1] += i;
      open.erase(node);
    }
    EXPECT_EQ(open.filled(), open);
  }
}

// A slit of one node closes, one of four does not.
TYPED_TEST(NodeSets, CloseSlitsOfANode) {
  constexpr int Dim = TypeParam::value;
  const auto box = NodeBox<Dim>::cube(0, 16);
  const auto slabs = NodeSet<Dim>::where(box, [&](std::size_t at) {
    const int x = box.node(at)[0];
    return (x >= 2 && x <= 8 && x != 5) || x >= 13;
  });
  const auto slit = NodeSet<Dim>::where(box, [&](std::size_t at) { return box.node(at)[0] == 5; });
  EXPECT_EQ(slabs.closed(), slabs | slit);
}

TYPED_TEST(NodeSets, KnowTheirBounds) {
  constexpr int Dim = TypeParam::value;
  for (const auto& box : this->boxes()) {
    NodeSet<Dim> set(box);
    auto low = box.lower, high = box.lower;
    for (int axis = 0; axis < Dim; ++axis) {
      low[axis] += 3;
      high[axis] += box.size[axis] - 2;
    }
    set.insert(low);
    set.insert(high);
    const auto found = set.bounds(2);
    for (int axis = 0; axis < Dim; ++axis) {
      EXPECT_EQ(found.lower[axis], low[axis] - 2);
      EXPECT_EQ(found.size[axis], high[axis] - low[axis] + 1 + 3);  // the box ends one beyond
    }
    EXPECT_EQ(NodeSet<Dim>(box).bounds(2).n(), 0u);
  }
}

}  // namespace
}  // namespace surf::segment
