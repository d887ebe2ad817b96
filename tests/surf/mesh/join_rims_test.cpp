#include "libsurf/mesh/detail/join_rims.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "libsurf/mesh/detail/rims.h"
#include "libsurf/mesh/primitives.h"
#include "surfaces.h"

namespace surf::mesh {
namespace {

constexpr int kAround = 40, kAcross = 12;
constexpr double kResolution = 0.06;  // edges of the torus are about 0.15 to 0.2

/// A torus some rings of which are removed, and a tube as the grown part: the same rings without
/// the first and the last, on vertices of their own.
struct TorusWithTube {
  const ConnectedSurface surface{to_mesh(torus(1, 0.35, kAround, kAcross))};
  RemovedTriangles removal;
  GrownPart part;

  TorusWithTube(int first, int last) {
    removal.is_removed = rings(first, last);
    for (int t = 0; t < surface.n_triangles(); ++t)
      if (removal.is_removed[t]) removal.core.push_back(t);
    grow(first + 1, last - 1);
  }

  /// Flags of the triangles between two rings.
  TriangleFlags rings(int first, int last) const {
    TriangleFlags out(surface.n_triangles(), 0);
    for (int t = 0; t < surface.n_triangles(); ++t) {
      const auto [low, high] =
          std::minmax({surface.vertex(t, 0) / kAcross, surface.vertex(t, 1) / kAcross,
                       surface.vertex(t, 2) / kAcross});
      out[t] = low >= first && high <= last;
    }
    return out;
  }

  /// Adds a tube to the grown part.
  void grow(int first, int last) {
    const int offset = surface.n_vertices() + int(part.points.size()) - first * kAcross;
    for (int v = first * kAcross; v < (last + 1) * kAcross; ++v)
      part.points.push_back(Vector<3>(surface.triangles.points.row(v)));
    const TriangleFlags is_there = rings(first, last);
    for (int t = 0; t < surface.n_triangles(); ++t)
      if (is_there[t])
        part.triangles.push_back({surface.vertex(t, 0) + offset, surface.vertex(t, 1) + offset,
                                  surface.vertex(t, 2) + offset});
    part.is_loose.assign(part.points.size(), 0);
    part.rims = rims(free_sides(part.triangles)).value();
  }

  int a_removed_triangle() const { return removal.core[removal.core.size() / 2]; }

  JoinedRims join(const std::vector<int>& events) const {
    return join_rims(surface, events, removal, part, kResolution);
  }
};

/// The surface with a patch in the place of what is removed.
Triangles with(const ConnectedSurface& surface, const Patch& patch) {
  std::vector<char> is_removed(surface.n_triangles(), 0);
  for (const int t : patch.removed) is_removed[t] = 1;
  std::vector<std::array<int, 3>> triangles;
  for (int t = 0; t < surface.n_triangles(); ++t)
    if (!is_removed[t])
      triangles.push_back({surface.vertex(t, 0), surface.vertex(t, 1), surface.vertex(t, 2)});
  triangles.insert(triangles.end(), patch.triangles.begin(), patch.triangles.end());
  // Without the vertices that are in no triangle any more.
  std::vector<int> number(surface.n_vertices() + patch.points.size(), -1);
  std::vector<Vector<3>> points;
  for (auto& triangle : triangles)
    for (int& v : triangle) {
      if (number[v] < 0) {
        number[v] = int(points.size());
        points.push_back(v < surface.n_vertices() ? Vector<3>(surface.triangles.points.row(v))
                                                  : patch.points[v - surface.n_vertices()]);
      }
      v = number[v];
    }
  Triangles out{Points<3>(points.size(), 3), Elements<3>(triangles.size(), 3)};
  for (std::size_t i = 0; i < points.size(); ++i) out.points.row(i) = points[i];
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) out.elements(t, i) = triangles[t][i];
  return out;
}

int euler(const Triangles& surface) {
  return int(surface.points.rows()) - int(surface.elements.rows()) / 2;
}

TEST(JoinRims, PutsAStripBetweenTheTwoRingsOfEachPair) {
  const TorusWithTube t(5, 12);
  const JoinedRims joined = t.join({t.a_removed_triangle()});
  ASSERT_TRUE(joined.patch);
  EXPECT_EQ(joined.patch->removed, t.removal.core);
  EXPECT_EQ(joined.patch->points.size(), t.part.points.size());
  // Two strips between rings of kAcross vertices each.
  EXPECT_EQ(joined.patch->triangles.size(), t.part.triangles.size() + 2 * 2 * kAcross);
  const Triangles whole = with(t.surface, *joined.patch);
  EXPECT_NO_THROW(check_mesh(to_mesh(whole)));
  EXPECT_EQ(euler(whole), 0);
}

TEST(JoinRims, LeavesAloneWhatHasNoEvent) {
  TorusWithTube t(5, 12);
  const TriangleFlags more = t.rings(20, 27);
  for (int f = 0; f < t.surface.n_triangles(); ++f)
    if (more[f]) t.removal.is_removed[f] = 1;
  t.grow(21, 26);
  const JoinedRims joined = t.join({t.a_removed_triangle()});
  ASSERT_TRUE(joined.patch);
  EXPECT_EQ(joined.patch->removed, t.removal.core);
  EXPECT_EQ(joined.patch->points.size(), std::size_t(6 * kAcross));  // rings 6 to 11
  EXPECT_NO_THROW(check_mesh(to_mesh(with(t.surface, *joined.patch))));
}

// What grew beside it has a small hole, too, that would be capped if it stayed.
TEST(JoinRims, CapsNothingOfWhatIsLeftAlone) {
  TorusWithTube t(5, 12);
  const TriangleFlags more = t.rings(20, 27);
  for (int f = 0; f < t.surface.n_triangles(); ++f)
    if (more[f]) t.removal.is_removed[f] = 1;
  const std::size_t n_of_tube = t.part.triangles.size();
  t.grow(21, 26);
  t.part.triangles.erase(t.part.triangles.begin() +
                         std::ptrdiff_t(n_of_tube + t.part.triangles.size()) / 2);
  t.part.rims = rims(free_sides(t.part.triangles)).value();
  ASSERT_EQ(t.part.rims.size(), 5u);
  const JoinedRims joined = join_rims(t.surface, {t.a_removed_triangle()}, t.removal, t.part, 0.1);
  ASSERT_TRUE(joined.patch);
  EXPECT_EQ(joined.patch->triangles.size(), n_of_tube + 2 * 2 * kAcross);
  EXPECT_NO_THROW(check_mesh(to_mesh(with(t.surface, *joined.patch))));
}

/// Appends the triangles of a surface, some of them left out, to the grown part.
void grow_copy(const ConnectedSurface& surface, const Triangles& copy,
               const std::vector<int>& left_out, GrownPart& part) {
  const int first = surface.n_vertices() + int(part.points.size());
  for (const auto point : copy.points.rowwise()) part.points.push_back(Vector<3>(point));
  for (int t = 0; t < copy.elements.rows(); ++t)
    if (std::find(left_out.begin(), left_out.end(), t) == left_out.end())
      part.triangles.push_back(
          {copy.elements(t, 0) + first, copy.elements(t, 1) + first, copy.elements(t, 2) + first});
  part.is_loose.assign(part.points.size(), 0);
  part.rims = rims(free_sides(part.triangles)).value();
}

// A ball is removed whole, so no rim tells which grown part is its own; here it has run into the
// tube, which has no event.
TEST(JoinRims, KeepsWhatGrewForAShellThatWasRemovedWhole) {
  const Triangles ring = torus(1, 0.35, kAround, kAcross), small = ball({4, 0, 0}, 0.3, 0.15);
  const TorusWithTube t(5, 12);
  const ConnectedSurface both(to_mesh(joined({ring, small})));
  RemovedTriangles removal = t.removal;
  removal.is_removed.resize(both.n_triangles(), 1);
  for (int f = t.surface.n_triangles(); f < both.n_triangles(); ++f) removal.core.push_back(f);
  GrownPart part = t.part;
  for (auto& triangle : part.triangles)
    for (int& v : triangle) v += int(small.points.rows());
  part.rims = rims(free_sides(part.triangles)).value();
  const JoinedRims result = join_rims(both, {both.n_triangles() - 1}, removal, part, kResolution);
  ASSERT_TRUE(result.patch);
  EXPECT_EQ(result.patch->removed, removal.core);
  EXPECT_EQ(result.patch->points.size(), part.points.size());
}

// The grid has left a hole in what grew for a ball, which is no scrap for all that.
TEST(JoinRims, CapsAHoleInAShellThatIsJoinedToNothing) {
  const Triangles small = ball({0, 0, 0}, 0.3, 0.1);
  const ConnectedSurface surface(to_mesh(small));
  RemovedTriangles removal;
  removal.is_removed.assign(surface.n_triangles(), 1);
  for (int f = 0; f < surface.n_triangles(); ++f) removal.core.push_back(f);
  GrownPart part;
  grow_copy(surface, small, {7}, part);
  const JoinedRims result = join_rims(surface, {0}, removal, part, 0.1);
  ASSERT_TRUE(result.patch);
  const Triangles whole = with(surface, *result.patch);
  EXPECT_EQ(whole.elements.rows(), small.elements.rows() + 2);
  EXPECT_NO_THROW(check_mesh(to_mesh(whole)));
}

TEST(JoinRims, DropsAScrapThatIsJoinedToNothing) {
  const Triangles small = ball({0, 0, 0}, 0.3, 0.1);
  TorusWithTube t(5, 12);
  std::vector<int> all_but_three;
  for (int f = 3; f < small.elements.rows(); ++f) all_but_three.push_back(f);
  const std::size_t n_of_tube = t.part.triangles.size();
  grow_copy(t.surface, small, all_but_three, t.part);
  ASSERT_EQ(t.part.triangles.size(), n_of_tube + 3);
  const JoinedRims result = join_rims(t.surface, {t.a_removed_triangle()}, t.removal, t.part, 0.1);
  ASSERT_TRUE(result.patch);
  EXPECT_EQ(result.patch->triangles.size(), n_of_tube + 2 * 2 * kAcross);
}

TEST(JoinRims, FailsWhereALongRimHasNoPartner) {
  TorusWithTube t(5, 12);
  t.part = {};
  EXPECT_FALSE(t.join({t.a_removed_triangle()}).patch);
}

TEST(JoinRims, TellsWhatHasNoEventWhenItFails) {
  TorusWithTube t(5, 12);
  const int event = t.a_removed_triangle();
  const TriangleFlags more = t.rings(20, 27);
  std::vector<int> expected;
  for (int f = 0; f < t.surface.n_triangles(); ++f)
    if (more[f]) {
      t.removal.is_removed[f] = 1;
      t.removal.core.push_back(f);
      expected.push_back(f);
    }
  t.part = {};
  const JoinedRims joined = t.join({event});
  EXPECT_FALSE(joined.patch);
  EXPECT_EQ(joined.without_event, expected);
}

/// With a coarser resolution the rims of the torus' tube, 2.2 long, are short.
TEST(JoinRims, CapsShortRimsWithoutAPartner) {
  TorusWithTube t(5, 12);
  t.part = {};
  const JoinedRims joined = join_rims(t.surface, {t.a_removed_triangle()}, t.removal, t.part, 0.3);
  ASSERT_TRUE(joined.patch);
  EXPECT_EQ(joined.patch->points.size(), 2u);
  EXPECT_EQ(joined.patch->triangles.size(), std::size_t(2 * kAcross));
  const Triangles whole = with(t.surface, *joined.patch);
  EXPECT_NO_THROW(check_mesh(to_mesh(whole)));
  EXPECT_EQ(euler(whole), 2);  // a bent tube with closed ends
}

TEST(JoinRims, SmoothsLooseVerticesOnly) {
  TorusWithTube t(5, 12);
  const int loose = 2 * kAcross + 3;  // in the middle of the tube
  const Vector<3> place = t.part.points[loose];
  t.part.points[loose] += Vector<3>(0.1, -0.1, 0.1);
  t.part.is_loose[loose] = 1;
  const JoinedRims joined = t.join({t.a_removed_triangle()});
  ASSERT_TRUE(joined.patch);
  int n_moved = 0;
  for (const Vector<3>& x : joined.patch->points) {
    bool is_there = false;
    for (const Vector<3>& y : t.part.points) is_there |= x == y;
    if (is_there) continue;
    ++n_moved;
    EXPECT_LT((x - place).norm(), 0.05);  // an edge is 0.15: near the middle of its neighbours
  }
  EXPECT_EQ(n_moved, 1);
}

}  // namespace
}  // namespace surf::mesh
