#include "libsurf/mesh/adaptivity.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using fem::Mark;

fem::Geometry<3> geometry(const TriMesh& mesh) { return {points(mesh), elements(mesh)}; }

double largest_variation(const TriMesh& mesh) {
  return fem::geometric_variation(geometry(mesh)).maxCoeff();
}

/// Longest edge of each triangle.
Eigen::VectorXd sizes(const TriMesh& mesh) {
  Eigen::VectorXd out(mesh.n_faces());
  for (const auto face : mesh.faces()) {
    double longest = 0;
    for (const auto h : mesh.fh_range(face)) longest = std::max(longest, mesh.calc_edge_length(h));
    out[face.idx()] = longest;
  }
  return out;
}

/// 1 / (1 + |x - c|^2 / w^2): changes near c only.
class Spot : public Field<3> {
 public:
  Spot(const Eigen::Vector3d& center, double width) : center_(center), width_(width) {}
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      out.value[i] = 1 / (1 + (x.row(i).transpose() - center_).squaredNorm() / (width_ * width_));
  }

 private:
  Eigen::Vector3d center_;
  double width_;
};

AdaptivityOptions by_geometry(double tolerance) {
  AdaptivityOptions options;
  options.geometry_tolerance_mm = tolerance;
  options.max_length_mm = 2;
  options.min_length_mm = 1e-3;
  return options;
}

TEST(Adaptivity, ByGeometryEndsWithinTheTolerance) {
  for (int kind = 0; kind < 4; ++kind)
    for (const double tolerance : {0.3, 0.1, 0.03}) {
      TriMesh mesh = to_mesh(some_surface(kind));
      const AdaptivityReport report = adapt(mesh, by_geometry(tolerance));
      EXPECT_TRUE(report.is_settled) << kind << ' ' << tolerance;
      EXPECT_LE(largest_variation(mesh), tolerance) << kind << ' ' << tolerance;
      check_mesh(mesh);
    }
}

TEST(Adaptivity, RefinesAtTheEdgesOfABoxAndLeavesItsFacesCoarse) {
  TriMesh mesh = to_mesh(box({0, 0, 0}, {1, 1, 1}, 0.5));
  AdaptivityOptions options = by_geometry(0.05);
  EXPECT_TRUE(adapt(mesh, options).is_settled);
  EXPECT_LE(largest_variation(mesh), 0.05);  // h pi/2 on each of a triangle's sharp edges
  double at_edges = 0, on_faces = 0;
  const Eigen::VectorXd size = sizes(mesh);
  for (const auto face : mesh.faces()) {
    const Eigen::Vector3d c = mesh.calc_face_centroid(face);
    const Eigen::Array3d to_side = c.array().min(1 - c.array());
    std::array<double, 3> d = {to_side[0], to_side[1], to_side[2]};
    std::sort(d.begin(), d.end());  // d[0] ~ 0: the face; d[1]: distance to the nearest edge
    if (d[1] < 0.03) at_edges = std::max(at_edges, size[face.idx()]);
    if (d[1] > 0.3) on_faces = std::max(on_faces, size[face.idx()]);
  }
  EXPECT_GT(on_faces, 4 * at_edges);
}

// Children have at most two thirds of their parent's sum over sides, or a little more: none asks
// again.
TEST(Adaptivity, BisectsASecondTimeOnlyWhereItIsStillNeeded) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.2));
  const auto n_before = static_cast<double>(mesh.n_faces());
  AdaptivityOptions options = by_geometry(0.9 * largest_variation(mesh));
  options.gamma_refine = 0.1;  // all faces are marked
  options.gamma_coarsen = 0;
  adapt(mesh, options, 1);
  EXPECT_GT(double(mesh.n_faces()), 1.9 * n_before);
  EXPECT_LT(double(mesh.n_faces()), 2.6 * n_before);  // twice, and the closure
}

TEST(Adaptivity, CoarsensWhatIsFinerThanTheToleranceAsks) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.35));
  adapt(mesh, by_geometry(0.01));
  const auto n_fine = mesh.n_faces();
  const AdaptivityReport report = adapt(mesh, by_geometry(0.1));
  EXPECT_TRUE(report.is_settled);
  EXPECT_GT(report.n_coarsened, 0);
  EXPECT_LT(mesh.n_faces(), n_fine / 4);
  EXPECT_LE(largest_variation(mesh), 0.1);
  check_mesh(mesh);
}

// The indicator of Alg. 6 as printed marks by the largest one: what it coarsens may have to be
// refined again.
TEST(Adaptivity, NeitherRefinesNorCoarsensForEver) {
  for (int kind = 0; kind < 4; ++kind)
    for (double tolerance = 0.02; tolerance < 0.5; tolerance *= 1.3) {
      TriMesh mesh = to_mesh(some_surface(kind));
      AdaptivityOptions options = by_geometry(tolerance);
      options.integral_tolerance = 0.01;
      options.integrands = {std::make_shared<Spot>(Eigen::Vector3d(1, 0, 0), 0.2)};
      EXPECT_TRUE(adapt(mesh, options).is_settled) << kind << ' ' << tolerance;
      const AdaptivityReport again = adapt(mesh, options);
      EXPECT_EQ(again.n_refined + again.n_coarsened, 0);
    }
}

TEST(Adaptivity, ByAnIntegralRefinesWhereTheIntegrandChanges) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.35));
  const Eigen::Vector3d place(1, 0, 0);
  const auto spot = std::make_shared<Spot>(place, 0.05);
  AdaptivityOptions options;
  options.integral_tolerance = 1e-4;
  options.integrands = {spot};
  options.max_length_mm = 1;
  EXPECT_TRUE(adapt(mesh, options).is_settled);
  const fem::Geometry<3> shape = geometry(mesh);
  EXPECT_LE(fem::quadrature_error(shape, *spot).sum(), 1e-4 * shape.measure());
  const Eigen::VectorXd size = sizes(mesh);
  for (const auto face : mesh.faces()) {
    const double distance = (mesh.calc_face_centroid(face) - place).norm();
    if (distance < 0.05) {
      EXPECT_LT(size[face.idx()], 0.06);
    }
    if (distance > 1) {
      EXPECT_GT(size[face.idx()], 0.2);
    }
  }
}

TEST(Adaptivity, RefinesIfAnyIndicatorSaysSoAndCoarsensIfAllDo) {
  const auto mesh = to_mesh(ball({0, 0, 0}, 1, 0.35));
  const fem::Geometry<3> shape = geometry(mesh);
  AdaptivityOptions loose = by_geometry(10);
  const auto count = [&](const AdaptivityOptions& options, Mark mark) {
    const auto marks = adaptivity_marks(shape, options);
    return std::count(marks.begin(), marks.end(), mark);
  };
  const auto n = static_cast<std::ptrdiff_t>(mesh.n_faces());
  EXPECT_EQ(count(loose, Mark::kCoarsen), n);
  AdaptivityOptions tight = by_geometry(1e-3);
  EXPECT_EQ(count(tight, Mark::kRefine), n);
  loose.integral_tolerance = 1e-5;
  loose.integrands = {std::make_shared<Spot>(Eigen::Vector3d(1, 0, 0), 0.1)};
  EXPECT_GT(count(loose, Mark::kRefine), 0);
  EXPECT_GT(count(loose, Mark::kCoarsen), 0);
  loose.integral_tolerance = 10;
  EXPECT_EQ(count(loose, Mark::kCoarsen), n);
}

TEST(Adaptivity, KeepsTheLimitsOnLengths) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.9));
  AdaptivityOptions options;
  options.max_length_mm = 0.2;
  EXPECT_TRUE(adapt(mesh, options).is_settled);
  EXPECT_LE(sizes(mesh).maxCoeff(), 0.2);
  options.geometry_tolerance_mm = 1e-4;
  options.min_length_mm = 0.1;
  const AdaptivityReport report = adapt(mesh, options);
  EXPECT_TRUE(report.is_settled);
  EXPECT_GT(report.n_refined, 0);
  EXPECT_GT(sizes(mesh).minCoeff(), 0.1 / 4);  // closure and two bisections at once
}

TEST(Adaptivity, IsFineWhereItIsToldToBe) {
  TriMesh mesh = to_mesh(box({0, 0, 0}, {4, 4, 4}, 2));
  AdaptivityOptions options;
  options.max_length_mm = 3;
  options.min_length_mm = 0.4;
  const auto is_fine = [](const Eigen::Matrix3d& corners) {
    return corners.col(0).maxCoeff() > 3.5 && corners.col(1).maxCoeff() > 3.5;
  };
  options.is_fine = is_fine;
  EXPECT_TRUE(adapt(mesh, options).is_settled);
  check_mesh(mesh);
  const Points<3> X = points(mesh);
  const Eigen::VectorXd size = sizes(mesh);
  double longest = 0;
  for (const auto face : mesh.faces()) {
    Eigen::Matrix3d corners;
    int i = 0;
    for (const auto vertex : mesh.fv_range(face)) corners.row(i++) = X.row(vertex.idx());
    if (is_fine(corners))
      EXPECT_LE(size[face.idx()], 0.4);
    else
      longest = std::max(longest, size[face.idx()]);
  }
  EXPECT_GT(longest, 2);
}

TEST(Adaptivity, KeepsTheLimitOnElements) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.35));
  AdaptivityOptions options = by_geometry(1e-3);
  options.max_elements = 5000;
  const AdaptivityReport report = adapt(mesh, options);
  EXPECT_TRUE(report.is_limited);
  EXPECT_LE(mesh.n_faces(), 5000u);
}

TEST(Adaptivity, LeavesVerticesWhereTheyAre) {
  TriMesh mesh = to_mesh(some_surface(1));
  const Points<3> before = points(mesh);
  adapt(mesh, by_geometry(0.05));
  EXPECT_EQ(points(mesh).topRows(before.rows()), before);
}

TEST(Adaptivity, RefusesOptionsThatContradictEachOther) {
  TriMesh mesh = to_mesh(some_surface(0));
  AdaptivityOptions options;
  EXPECT_THROW(adapt(mesh, options), UsageError);  // max_length_mm = 0
  options.max_length_mm = 1;
  options.min_length_mm = 2;
  EXPECT_THROW(adapt(mesh, options), UsageError);
  options.min_length_mm = 0;
  options.gamma_coarsen = 0.8;
  EXPECT_THROW(adapt(mesh, options), UsageError);
  options.gamma_coarsen = 0.3;
  options.geometry_tolerance_mm = -1;
  EXPECT_THROW(adapt(mesh, options), UsageError);
}

}  // namespace
}  // namespace surf::mesh
