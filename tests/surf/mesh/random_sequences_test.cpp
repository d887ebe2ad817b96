// Random sequences of all operations on random closed surfaces: every invariant after each.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "libsurf/mesh/angle_width.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/improve.h"
#include "libsurf/mesh/smoothing.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

int euler_number(const TriMesh& mesh) {
  return static_cast<int>(mesh.n_vertices()) - static_cast<int>(mesh.n_edges()) +
         static_cast<int>(mesh.n_faces());
}

/// What an operation leaves as it is.
struct Kept {
  bool area = false, volume = false;
};

Kept bisect_random_faces(TriMesh& mesh, std::mt19937& random) {
  std::bernoulli_distribution is_marked(0.15);
  std::vector<OpenMesh::FaceHandle> marked;
  for (const auto face : mesh.faces())
    if (is_marked(random)) marked.push_back(face);
  const auto n_before = mesh.n_faces();
  const int n_new = bisect(mesh, marked);
  EXPECT_EQ(mesh.n_faces(), n_before + 2 * n_new);
  return {.area = true, .volume = true};
}

Kept do_something(TriMesh& mesh, int what, std::mt19937& random) {
  switch (what) {
    case 0:
      return bisect_random_faces(mesh, random);
    case 1:
      mark_longest_edges(mesh);
      return {.area = true, .volume = true};
    case 2:
      move(mesh, WavyField(random, 0.05));
      return {};
    case 3:
      smooth(mesh, {.n_sweeps = 2});
      return {.volume = true};
    case 4:
      control_angle_width(mesh, {.max_rounds = 2});
      return {.volume = true};
    default:
      improve(mesh, {.min_length = 0.1, .max_length = 0.5, .tolerance_mm = 0.03});
      return {};
  }
}

TEST(RandomSequences, KeepEveryInvariant) {
  constexpr int kSequences = 200, kOperations = 8;
  constexpr double kTolerance = 1e-12;  // relative; a few thousand terms of rounding eps
  std::mt19937 random(2024);
  std::uniform_int_distribution<int> operation(0, 5);
  for (int sequence = 0; sequence < kSequences; ++sequence) {
    TriMesh mesh = to_mesh(some_surface(sequence));
    const int euler = euler_number(mesh);
    for (int step = 0; step < kOperations; ++step) {
      const double area = surface_area(mesh), volume = enclosed_volume(mesh);
      const int what = operation(random);
      const Kept kept = do_something(mesh, what, random);
      ASSERT_NO_THROW(check_mesh(mesh)) << "sequence " << sequence << ", operation " << what;
      ASSERT_EQ(euler_number(mesh), euler) << "sequence " << sequence << ", operation " << what;
      if (kept.area) {
        ASSERT_NEAR(surface_area(mesh) / area, 1, kTolerance) << what;
      }
      if (kept.volume) {
        ASSERT_NEAR(enclosed_volume(mesh) / volume, 1, kTolerance) << what;
      }
    }
  }
}

}  // namespace
}  // namespace surf::mesh
