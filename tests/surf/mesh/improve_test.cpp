#include "libsurf/mesh/improve.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <stdexcept>

#include "libsurf/base/threads.h"
#include "libsurf/fem/indicators.h"
#include "libsurf/mesh/bisection.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

int euler_number(const TriMesh& mesh) {
  return static_cast<int>(mesh.n_vertices()) - static_cast<int>(mesh.n_edges()) +
         static_cast<int>(mesh.n_faces());
}

double distance_to_segment(const Vector3d& x, const Vector3d& a, const Vector3d& b) {
  const double t = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (x - a - t * (b - a)).norm();
}

double distance_to_triangle(const Vector3d& x, const Vector3d& a, const Vector3d& b,
                            const Vector3d& c) {
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian << b - a, c - a;
  const Eigen::Vector2d at =
      (jacobian.transpose() * jacobian).ldlt().solve(jacobian.transpose() * (x - a));
  if (at.minCoeff() >= 0 && at.sum() <= 1) return (x - a - jacobian * at).norm();
  return std::min(
      {distance_to_segment(x, a, b), distance_to_segment(x, b, c), distance_to_segment(x, c, a)});
}

double distance_to(const Triangles& surface, const Vector3d& x) {
  double closest = std::numeric_limits<double>::max();
  for (const auto& t : surface.elements.rowwise())
    closest =
        std::min(closest, distance_to_triangle(x, surface.points.row(t[0]),
                                               surface.points.row(t[1]), surface.points.row(t[2])));
  return closest;
}

/// Largest distance of vertices, midpoints of sides and centroids of one surface from the other.
double one_sided_distance(const Triangles& from, const Triangles& to) {
  double largest = 0;
  for (int j = 0; j < from.elements.rows(); j += 20) {  // enough of them
    const auto t = from.elements.row(j);
    const Vector3d a = from.points.row(t[0]), b = from.points.row(t[1]), c = from.points.row(t[2]);
    for (const Vector3d& x : {a, Vector3d((a + b) / 2), Vector3d((b + c) / 2),
                              Vector3d((c + a) / 2), Vector3d((a + b + c) / 3)})
      largest = std::max(largest, distance_to(to, x));
  }
  return largest;
}

/// Vertices shifted at random, so that there are needles, caps and short edges.
TriMesh rough_surface(int kind, std::mt19937& random) {
  TriMesh mesh = to_mesh(some_surface(kind));
  refine_long_edges(mesh, 0.2);
  move(mesh, WavyField(random, 0.1));
  std::uniform_real_distribution<double> shift(-0.03, 0.03);
  for (const auto vertex : mesh.vertices())
    mesh.set_point(vertex,
                   mesh.point(vertex) + Vector3d(shift(random), shift(random), shift(random)));
  return mesh;
}

const ImproveOptions kOptions{.min_length = 0.06, .max_length = 0.25, .tolerance_mm = 0.02};

TEST(Improve, KeepsItsPromisesOnRoughSurfaces) {
  std::mt19937 random(1);
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = rough_surface(kind, random);
    const Triangles before = to_triangles(mesh);
    const int euler = euler_number(mesh);
    const double volume = enclosed_volume(mesh), longest = longest_edge(mesh);
    const double poor_before = 1 - share_of_angles_above(mesh, kOptions.min_angle_deg);
    const ImproveReport report = improve(mesh, kOptions);
    check_mesh(mesh);
    EXPECT_TRUE(has_refinement_edges(mesh));
    EXPECT_EQ(euler_number(mesh), euler);
    EXPECT_GT(report.n_flipped + report.n_collapsed + report.n_moved, 0);
    EXPECT_NEAR(report.min_angle_deg, min_angle_deg(mesh), 1e-6);
    const double poor = 1 - share_of_angles_above(mesh, kOptions.min_angle_deg);
    EXPECT_NEAR(poor * static_cast<double>(mesh.n_faces()), report.n_poor, 1e-6);
    EXPECT_LE(poor, 0.2 * poor_before);
    // Moves may lengthen edges a little, collapses and flips may not.
    EXPECT_LE(longest_edge(mesh), 1.2 * std::max(longest, kOptions.max_length));

    const Triangles after = to_triangles(mesh);
    // Distances are sampled in improve() and here at different places of the triangles.
    constexpr double kSlack = 1.1;
    EXPECT_LE(one_sided_distance(after, before), kSlack * kOptions.tolerance_mm);
    EXPECT_LE(one_sided_distance(before, after), kSlack * kOptions.tolerance_mm);
    EXPECT_LE(std::abs(enclosed_volume(mesh) - volume), kOptions.tolerance_mm * surface_area(mesh));
  }
}

// Flips are the only operation that changes the volume; here there is none to make.
TEST(Improve, ACollapseKeepsTheVolume) {
  TriMesh mesh = to_mesh(ball(Vector3d::Zero(), 1, 0.2));
  const auto edge = mesh.halfedge_handle(OpenMesh::EdgeHandle(100), 0);
  const Vector3d from = mesh.point(mesh.from_vertex_handle(edge));
  const Vector3d to = mesh.point(mesh.to_vertex_handle(edge));
  mesh.set_point(mesh.from_vertex_handle(edge), from + 0.8 * (to - from));
  const double volume = enclosed_volume(mesh);
  const ImproveReport report =
      improve(mesh, {.min_length = 0.1, .max_length = 0.4, .tolerance_mm = 0.05, .n_sweeps = 1});
  EXPECT_EQ(report.n_collapsed, 1);
  EXPECT_EQ(report.n_flipped, 0);
  EXPECT_NEAR(enclosed_volume(mesh) / volume, 1, 1e-13);
}

TEST(Improve, RemovesShortEdges) {
  TriMesh mesh = to_mesh(ball(Vector3d::Zero(), 1, 0.05));
  const auto n_before = mesh.n_faces();
  const ImproveOptions options{.min_length = 0.06, .max_length = 0.2, .tolerance_mm = 0.01};
  const ImproveReport report = improve(mesh, options);
  check_mesh(mesh);
  EXPECT_LT(2 * mesh.n_faces(), n_before);
  EXPECT_EQ(n_before - mesh.n_faces(), 2u * report.n_collapsed);
  int n_short = 0;
  for (const auto edge : mesh.edges()) n_short += mesh.calc_edge_length(edge) < 0.06;
  EXPECT_LE(n_short, static_cast<int>(mesh.n_edges()) / 50);
  EXPECT_GE(min_angle_deg(mesh), 20);
}

TEST(Improve, MendsACapByAFlip) {
  TriMesh mesh = to_mesh(box(Vector3d::Zero(), Vector3d(1, 1, 1), 0.25));
  // An inner vertex of the top moves close to the side of one of its triangles.
  OpenMesh::VertexHandle inner;
  for (const auto vertex : mesh.vertices())
    if ((mesh.point(vertex) - Vector3d(0.5, 0.5, 1)).norm() < 1e-9) inner = vertex;
  mesh.set_point(inner, Vector3d(0.73, 0.62, 1));
  const Triangles before = to_triangles(mesh);
  ASSERT_LT(min_angle_deg(mesh), 12);
  improve(mesh, {.min_length = 0.01, .max_length = 0.6, .tolerance_mm = 1e-6});
  check_mesh(mesh);
  EXPECT_GE(min_angle_deg(mesh), 20);
  EXPECT_NEAR(enclosed_volume(mesh), 1, 1e-5);
  EXPECT_LE(one_sided_distance(before, to_triangles(mesh)), 1.1e-6);
}

TEST(Improve, KeepsSharpEdges) {
  std::mt19937 random(4);
  TriMesh mesh = to_mesh(box(Vector3d::Zero(), Vector3d(1, 1, 1), 0.125));
  std::uniform_real_distribution<double> shift(-0.05, 0.05);
  for (const auto vertex : mesh.vertices()) {
    Vector3d x = mesh.point(vertex);
    for (int axis = 0; axis < 3; ++axis)  // along the sides it lies in
      if (x[axis] > 0 && x[axis] < 1) x[axis] += shift(random);
    mesh.set_point(vertex, x);
  }
  const Triangles before = to_triangles(mesh);
  constexpr double kTolerance = 0.004;
  improve(mesh, {.min_length = 0.05, .max_length = 0.3, .tolerance_mm = kTolerance});
  check_mesh(mesh);
  EXPECT_LE(one_sided_distance(before, to_triangles(mesh)), 1.1 * kTolerance);
  EXPECT_NEAR(enclosed_volume(mesh), 1, 6 * kTolerance);
  EXPECT_GE(share_of_angles_above(mesh, 20), 0.99);
}

TEST(Improve, LeavesAGoodSurfaceBitForBit) {
  TriMesh mesh = to_mesh(ball(Vector3d(1, 2, 3), 1, 0.1));
  const Triangles before = to_triangles(mesh);
  improve(mesh, {.min_length = 0.04, .max_length = 0.2, .tolerance_mm = 0.01});
  EXPECT_EQ(points(mesh), before.points);
  EXPECT_EQ(elements(mesh), before.elements);
}

TEST(Improve, IsTheSameTwice) {
  const auto improved = [] {
    std::mt19937 random(5);
    TriMesh mesh = rough_surface(3, random);
    improve(mesh, kOptions);
    return to_triangles(mesh);
  };
  const Triangles first = improved(), second = improved();
  EXPECT_EQ(first.points, second.points);
  EXPECT_EQ(first.elements, second.elements);
}

TEST(Improve, RefusesOptionsThatContradictEachOther) {
  TriMesh mesh = to_mesh(some_surface(0));
  EXPECT_THROW(improve(mesh, {}), std::invalid_argument);
  EXPECT_EQ(kOptions.error(), "");
  ImproveOptions options = kOptions;
  options.max_length = 0.1;
  EXPECT_EQ(options.error(), "ImproveOptions::max_length = 0.1 violates > 2 * min_length");
}

// ---- runs: a surface that moves, is refined and mended in every step ----

constexpr double kEdge = 0.35;

void mend(TriMesh& mesh) {
  refine_long_edges(mesh, 1.5 * kEdge);
  improve(mesh,
          {.min_length = 0.5 * kEdge, .max_length = 1.5 * kEdge, .tolerance_mm = 0.1 * kEdge});
}

void expect_good_triangles(const TriMesh& mesh) {
  check_mesh(mesh);
  EXPECT_GE(min_angle_deg(mesh), 15);
  EXPECT_GE(share_of_angles_above(mesh, 25), 0.99);
}

void scale(TriMesh& mesh, const Vector3d& factors) {
  for (const auto vertex : mesh.vertices())
    mesh.set_point(vertex, mesh.point(vertex).cwiseProduct(factors));
}

TEST(ImproveRun, OfABallThatGrowsToAnEllipsoidOfAHundredTimesItsAreaHasGoodTriangles) {
  TriMesh mesh = to_mesh(ball(Vector3d::Zero(), 1, kEdge));
  const double area = surface_area(mesh);
  constexpr int kSteps = 100;
  const double across = std::pow(7.0, 1.0 / kSteps), along = std::pow(21.0, 1.0 / kSteps);
  for (int step = 0; step < kSteps; ++step) {
    scale(mesh, Vector3d(across, along, across));
    mend(mesh);
  }
  expect_good_triangles(mesh);
  EXPECT_GT(surface_area(mesh), 100 * area);
  EXPECT_NEAR(enclosed_volume(mesh) / (4 * std::numbers::pi / 3 * 7 * 7 * 21), 1, 0.05);
}

TEST(ImproveRun, OfATorusThatShrinksUnevenlyHasGoodTriangles) {
  TriMesh mesh = to_mesh(torus(6, 2.5, 110, 45));
  for (int step = 0; step < 80; ++step) {
    scale(mesh, Vector3d(0.985, 0.995, 0.98));
    mend(mesh);
  }
  expect_good_triangles(mesh);
  EXPECT_EQ(euler_number(mesh), 0);
}

TEST(ImproveRun, OfABallInAWavyFlowHasGoodTriangles) {
  std::mt19937 random(6);
  TriMesh mesh = to_mesh(ball(Vector3d::Zero(), 2.5, kEdge));
  for (int step = 0; step < 60; ++step) {
    move(mesh, WavyField(random, 0.03));
    mend(mesh);
  }
  expect_good_triangles(mesh);
}

// A poor place is mended; bisections elsewhere can be undone, and what is left is what was there.
TEST(Improve, ForgetsBisectionsOnlyWhereItFlipsOrCollapses) {
  TriMesh mesh = to_mesh(ball(Vector3d::Zero(), 1, 0.3));
  std::vector<OpenMesh::FaceHandle> all;
  for (const auto face : mesh.faces()) all.push_back(face);
  const auto n_start = static_cast<int>(mesh.n_vertices());
  const int n_new = bisect(mesh, all);
  for (const auto edge : mesh.edges())  // one edge shrinks to a fifth
    if (edge.v0().idx() >= n_start || edge.v1().idx() >= n_start) {
      const Vector3d middle = 0.5 * (mesh.point(edge.v0()) + mesh.point(edge.v1()));
      for (const auto end : {edge.v0(), edge.v1()})
        mesh.set_point(end, 0.2 * mesh.point(end) + 0.8 * middle);
      break;
    }
  const ImproveReport report =
      improve(mesh, {.min_length = 0.06, .max_length = 0.5, .tolerance_mm = 0.05});
  check_mesh(mesh);
  EXPECT_GE(report.n_collapsed, 1);
  int n_removed = 0, n_layer = 0;
  do {
    std::vector<OpenMesh::FaceHandle> faces;
    for (const auto face : mesh.faces()) faces.push_back(face);
    n_removed += n_layer = coarsen(mesh, faces);
    check_mesh(mesh);
    EXPECT_EQ(euler_number(mesh), 2);
  } while (n_layer > 0);
  EXPECT_LT(n_removed, n_new);
  EXPECT_GT(2 * n_removed, n_new);
  EXPECT_GT(min_angle_deg(mesh), 5);
}

TEST(Improve, TimeOnTwentyThousandTrianglesIsPrinted) {
  const double edge = 1.21 / 32;
  for (const double jitter : {0.0, 0.1, 0.25}) {
    TriMesh mesh = to_mesh(ball(Vector3d::Zero(), 1, edge));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> shift(-jitter * edge, jitter * edge);
    for (const auto vertex : mesh.vertices())
      mesh.set_point(vertex,
                     mesh.point(vertex) + Vector3d(shift(random), shift(random), shift(random)));
    const double share = share_of_angles_above(mesh, 30);
    const auto start = std::chrono::steady_clock::now();
    const ImproveReport report = improve(
        mesh, {.min_length = 0.5 * edge, .max_length = 1.6 * edge, .tolerance_mm = 0.1 * edge});
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    check_mesh(mesh);
    std::printf(
        "%zu triangles, %.2f %% below 30 degrees: %.1f ms, %d flips, %d collapses, %d moves\n",
        mesh.n_faces(), 100 * (1 - share), time.count(), report.n_flipped, report.n_collapsed,
        report.n_moved);
  }
}

ImproveOptions coarsening(const TriMesh& mesh, double variation) {
  ImproveOptions options;
  options.max_length = 2;
  options.tolerance_mm = 0.1;
  options.max_variation_mm = variation;
  options.may_coarsen.assign(mesh.n_faces(), 1);
  return options;
}

TEST(ImproveCoarsening, CollapsesWhatMayBeCoarserWithinTheVariation) {
  constexpr double kVariation = 0.2;
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.1));
  const double volume = enclosed_volume(mesh);
  const auto n_before = mesh.n_faces();
  for (int round = 0; round < 10; ++round) improve(mesh, coarsening(mesh, kVariation));
  EXPECT_LT(mesh.n_faces(), n_before / 3);
  const fem::Geometry<3> shape(points(mesh), elements(mesh));
  // The triangles beyond the rim of a collapse are not looked at: their sides change by half.
  EXPECT_LT(fem::geometric_variation(shape).maxCoeff(), 1.5 * kVariation);
  EXPECT_GT(angles_deg(mesh).minCoeff(), 25);
  EXPECT_NEAR(enclosed_volume(mesh), volume, 0.01 * volume);
  check_mesh(mesh);
}

// What is planned ahead on several threads is what would be planned in its turn.
TEST(ImproveCoarsening, IsTheSameOnOneThreadAndOnFour) {
  const auto improved = [](int n_threads) {
    const ThreadLimit limit(n_threads);
    std::mt19937 random(7);
    TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.06));
    std::uniform_real_distribution<double> shift(-0.01, 0.01);
    for (const auto vertex : mesh.vertices())
      mesh.set_point(vertex,
                     mesh.point(vertex) + Vector3d(shift(random), shift(random), shift(random)));
    for (int round = 0; round < 3; ++round) {
      ImproveOptions options = coarsening(mesh, 0.2);
      options.min_length = 0.05;
      const ImproveReport report = improve(mesh, options);
      EXPECT_GT(report.n_collapsed, 100);
      EXPECT_GT(report.n_moved, 0);
    }
    return to_triangles(mesh);
  };
  const Triangles one = improved(1), four = improved(4);
  EXPECT_EQ(one.points, four.points);
  EXPECT_EQ(one.elements, four.elements);
}

TEST(ImproveCoarsening, LeavesFacesWithoutAFlagAlone) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.1));
  ImproveOptions options = coarsening(mesh, 0.2);
  for (const auto face : mesh.faces())
    options.may_coarsen[face.idx()] = mesh.calc_face_centroid(face)[0] > 0;
  const auto n_left = [&] {
    int n = 0;
    for (const auto face : mesh.faces()) n += mesh.calc_face_centroid(face)[0] < -0.1;
    return n;
  };
  const int before = n_left();
  EXPECT_GT(improve(mesh, options).n_collapsed, 0);
  EXPECT_EQ(n_left(), before);
}

}  // namespace
}  // namespace surf::mesh
