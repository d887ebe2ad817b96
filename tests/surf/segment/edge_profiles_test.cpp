#include "libsurf/segment/detail/edge_profiles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/detail/locate_edges.h"
#include "libsurf/segment/detail/smooth_moves.h"
#include "libsurf/segment/segment.h"

namespace surf::segment {
namespace {

constexpr int kSize = 36;
constexpr double kRadius = 11;
const Vector<3> kCenter(0.3, -0.2, 0.1);

/// Voxels of 1 mm round the origin.
template <class Function>
volume::Volume volume_of(const Function& I) {
  std::vector<float> values;
  const double middle = (kSize - 1) / 2.0;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i)
        values.push_back(float(I(Vector<3>(i - middle, j - middle, k - middle))));
  Eigen::Affine3d affine = Eigen::Affine3d::Identity();
  affine.translation().setConstant(-middle);
  return volume::Volume({kSize, kSize, kSize}, affine, values);
}

/// From 300 inside to 100 outside, by a Gaussian blur of deviation s along the radius.
volume::Volume radial_step(double s) {
  return volume_of([s](const Vector<3>& x) {
    return 200 - 100 * std::erf(((x - kCenter).norm() - kRadius) / (std::numbers::sqrt2 * s));
  });
}

/// A ball of value 1 that is blurred by a Gaussian of deviation s in space, exactly.
double blurred_ball(double r, double s) {
  const double root = std::numbers::sqrt2 * s;
  const auto bell = [&](double t) { return std::exp(-t * t / (2 * s * s)); };
  return (std::erf((r + kRadius) / root) - std::erf((r - kRadius) / root)) / 2 -
         s / (r * std::sqrt(2 * std::numbers::pi)) * (bell(r - kRadius) - bell(r + kRadius));
}

Points<3> unit_normals(const fem::Geometry<3>& geometry) {
  return geometry.nodal_normals().rowwise().normalized();
}

double mean_radius(const Points<3>& X) {
  return (X.rowwise() - kCenter.transpose()).rowwise().norm().mean();
}

TEST(EdgeCells, AreThoseNearASphereOnceWithTheirDistances) {
  const auto setting = make_setting(radial_step(1));
  const Triangles ball = mesh::ball(kCenter, kRadius, 2);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const double reach = 3;
  const auto cells =
      edge_cells<3>(*setting, geometry, unit_normals(geometry), reach, {setting->extent(), 1});
  // Flat elements lie up to h^2 / (6 R) inside the sphere, normals of vertices lean by h / R.
  const double tolerance = 0.12;
  std::set<std::uint64_t> known;
  for (const auto& cell : cells) {
    EXPECT_TRUE(known.insert(cell.index).second);
    const Vector<3> x(double(cell.index % kSize), double(cell.index / kSize % kSize),
                      double(cell.index / (kSize * kSize)));
    const double distance =
        (x.array() - (kSize - 1) / 2.0).matrix().eval().operator-(kCenter).norm();
    EXPECT_NEAR(cell.distance_mm, distance - kRadius, tolerance);
    EXPECT_NEAR(cell.lambda[0] + cell.lambda[1] + cell.lambda[2], 1, 1e-6);
    EXPECT_GE(*std::min_element(cell.lambda.begin(), cell.lambda.end()), -1e-6);
  }
  int n_near = 0;
  for (std::uint64_t index = 0; index < std::uint64_t(kSize) * kSize * kSize; ++index) {
    const Vector<3> x(double(index % kSize), double(index / kSize % kSize),
                      double(index / (kSize * kSize)));
    const Vector<3> at = x - Vector<3>::Constant((kSize - 1) / 2.0) - kCenter;
    if (std::abs(at.norm() - kRadius) > reach - tolerance) continue;
    ++n_near;
    EXPECT_TRUE(known.contains(index)) << at.transpose();
  }
  EXPECT_GT(n_near, 5000);
}

TEST(EdgeCells, AreReachedFromElementsVerticesAndIndices) {
  const auto setting = make_setting(radial_step(1));
  const Triangles ball = mesh::ball(kCenter, kRadius, 3);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const auto cells =
      edge_cells<3>(*setting, geometry, unit_normals(geometry), 2, {setting->extent(), 1});
  using Place = std::pair<std::size_t, int>;  // and corner
  std::vector<std::set<Place>> round(std::size_t(ball.points.rows()));
  std::set<std::size_t> beside;
  for (std::size_t k = 0; k < cells.size(); ++k)
    for (int i = 0; i < 3; ++i)
      round[std::size_t(ball.elements(cells[k].element, i))].insert({k, i});
  for (std::size_t i = 0; i < round.size(); ++i) {
    std::set<Place> found;
    cells.for_each_round(Eigen::Index(i), [&](std::size_t k, int corner) {
      EXPECT_TRUE(found.insert({k, corner}).second);
    });
    EXPECT_EQ(found, round[i]);
  }
  for (Eigen::Index t = 0; t < ball.elements.rows(); ++t)
    cells.for_each_beside(t, [&](std::size_t k) {
      EXPECT_EQ(cells[k].element, t);
      EXPECT_TRUE(beside.insert(k).second);
    });
  EXPECT_EQ(beside.size(), cells.size());
  EXPECT_EQ(cells.by_index().size(), cells.size());
  for (std::size_t n = 1; n < cells.size(); ++n)
    EXPECT_LT(cells[cells.by_index()[n - 1]].index, cells[cells.by_index()[n]].index);
}

TEST(EdgeCells, InBlocksAreTheirMeansAtTheirCentres) {
  const auto linear = [](const Vector<3>& x) { return 50 + x[0] - 2 * x[1] + 3 * x[2]; };
  const auto setting = make_setting(volume_of(linear));
  const Triangles ball = mesh::ball(kCenter, kRadius, 2);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const CellBlocks<3> blocks(setting->extent(), 3);
  EXPECT_EQ(blocks.box.size[2], kSize / 3);
  const auto cells = edge_cells<3>(*setting, geometry, unit_normals(geometry), 4, blocks);
  EXPECT_GT(cells.size(), 400u);
  for (const auto& cell : cells) {
    Vector<3> index;
    for (std::uint64_t axis = 0, left = cell.index; axis < 3; ++axis, left /= kSize / 3)
      index[Eigen::Index(axis)] = double(left % (kSize / 3));
    const Vector<3> x = blocks.box.index_to_world * index;
    EXPECT_NEAR(cell.value, linear(x), 1e-4);
    EXPECT_NEAR(cell.distance_mm, (x - kCenter).norm() - kRadius, 0.12);
  }
}

// Blocks of two voxels, where a blur has a deviation of three.
TEST(LocateEdges, FindsAWideEdgeByBlocks) {
  const double s = 3;
  const auto setting = make_setting(radial_step(s));
  const LocatedEdges<3> located =
      locate_edges<3>(*setting, mesh::ball(kCenter, kRadius - 0.5, 4.5), s);
  EXPECT_NEAR(mean_radius(located.points) - 4.5 * 4.5 / (8 * kRadius), kRadius, 0.1);
  EXPECT_NEAR(located.blur_mm, s, 0.1 * s);
}

// What is told of the noise is that of single cells, whether they were looked at in blocks or not.
TEST(LocateEdges, TellsTheNoiseOfCellsOfBlocksToo) {
  const double s = 3, noise = 10;
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0, noise);
  const auto setting = make_setting(volume_of([&](const Vector<3>& x) {
    return 200 - 100 * std::erf(((x - kCenter).norm() - kRadius) / (std::numbers::sqrt2 * s)) +
           normal(generator);
  }));
  for (const double edge : {1.5, 4.5}) {  // cells by themselves, blocks of two
    const LocatedEdges<3> located =
        locate_edges<3>(*setting, mesh::ball(kCenter, kRadius - 0.3, edge), s);
    EXPECT_NEAR(located.noise, noise, 0.1 * noise) << edge;
    EXPECT_NEAR(located.blur_mm, s, 0.1 * s) << edge;
    const Eigen::VectorXd& strength = located.certainty.edge_strength;
    EXPECT_NEAR(strength.mean(), 200 / noise, 0.15 * 200 / noise) << edge;
  }
}

TEST(LocateEdges, LooksAtCellsWhereTheBlurWasTakenForTooWide) {
  const auto setting = make_setting(radial_step(0.8));
  const LocatedEdges<3> located =
      locate_edges<3>(*setting, mesh::ball(kCenter, kRadius - 0.3, 6), 3.2);
  EXPECT_NEAR(located.blur_mm, 0.8, 0.2);
}

TEST(EdgeProfiles, FindLevelsWidthAndPlace) {
  const double s = 1.2, off = 0.4;
  const auto setting = make_setting(radial_step(s));
  const Triangles ball = mesh::ball(kCenter, kRadius - off, 1.5);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const double reach = 5;
  const auto cells =
      edge_cells<3>(*setting, geometry, unit_normals(geometry), reach, {setting->extent(), 1});
  ProfileOptions options;
  options.reach_mm = reach;
  options.width_mm = 1;
  options.least_noise = 0.01;
  const EdgeProfiles found =
      fit_edge_profiles<3>(geometry, cells, Eigen::VectorXd::Zero(ball.points.rows()),
                           ProfilePool<3>(geometry, 3), options);
  for (Eigen::Index i = 0; i < ball.points.rows(); ++i) {
    EXPECT_NEAR(found.inside[i], 300, 1);
    EXPECT_NEAR(found.outside[i], 100, 1);
    EXPECT_NEAR(found.width_mm[i], s, 0.03);
    EXPECT_NEAR(found.place_mm[i], off, 0.04);  // h^2 / (8 R) of it by the flat elements
    EXPECT_GT(found.explained[i], 0.999);
  }
}

// A blur in space moves the step along a sphere's normal: I = step(r - R) - s^2 / r step'(r - R),
// that is a step at R - s^2 kappa / 2 with kappa = 2 / R. The fit finds that place, where the image
// is halfway between its levels: what the camera blurred it cannot know.
TEST(LocateEdges, FindsABlurredBallWhereItIsHalfway) {
  for (const double s : {0.8, 1.5}) {
    const auto setting = make_setting(
        volume_of([s](const Vector<3>& x) { return blurred_ball((x - kCenter).norm(), s); }));
    const Triangles start = mesh::ball(kCenter, kRadius - 0.3, 1);
    const LocatedEdges<3> located = locate_edges<3>(*setting, start, s);
    const double shift = s * s / kRadius;
    const double offset = 1.0 / (8 * kRadius);  // of the vertices by flat elements, h = 1
    EXPECT_NEAR(mean_radius(located.points) - offset, kRadius - shift, 0.12 * shift + 0.005) << s;
    EXPECT_NEAR(located.blur_mm, s, 0.06 * s);
  }
}

TEST(BendingMatrices, AreTheProduct) {
  const Triangles ball = mesh::ball(kCenter, kRadius, 4);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const BendingMatrices bending(geometry);
  const Eigen::VectorXd d = Eigen::VectorXd::LinSpaced(ball.points.rows(), 0, 2);
  const Eigen::MatrixXd A = bending.stiffness();
  EXPECT_LT((Eigen::MatrixXd(bending(d)) - A * d.asDiagonal() * A).norm(), 1e-12 * A.norm());
}

TEST(Posterior, HasTheVariancesOfTheInverse) {
  const Triangles ball = mesh::ball(kCenter, kRadius, 4);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const BendingMatrices bending(geometry);
  const SmoothMoves<3> prior(bending, geometry, unit_normals(geometry), 10);
  const Eigen::Index n = ball.points.rows();
  Observations data;
  data.b.setLinSpaced(n, -1, 1);
  data.P.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) data.P.insert(i, i) = 1 + double(i % 3);
  const Eigen::VectorXd before = Eigen::VectorXd::Constant(n, 0.2);
  const Eigen::SparseMatrix<double> Q = prior.precision(3, Eigen::VectorXd::Ones(n));
  const Posterior posterior(bending.cholesky(), Q, data, before);
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(Q + data.P).inverse();
  EXPECT_LT((posterior.variances() - inverse.diagonal()).cwiseAbs().maxCoeff(),
            1e-9 * inverse.diagonal().maxCoeff());
  EXPECT_LT((posterior.mean() - inverse * (Q * before + data.b)).norm(), 1e-9);
  EXPECT_NEAR(posterior.variance_of(data.b), data.b.dot(inverse * data.b), 1e-9);
}

Eigen::VectorXd smoothing(const fem::Geometry<3>& geometry, const Points<3>& normals) {
  const BendingMatrices bending(geometry);
  return SmoothMoves<3>(bending, geometry, normals, 6).smoothing();
}

TEST(SmoothMoves, TakeOffRipplesAndLeaveTheBall) {
  const Triangles ball = mesh::ball(kCenter, kRadius, 1);
  const fem::Geometry<3> smooth(ball.points, ball.elements);
  const Points<3> normals = unit_normals(smooth);
  EXPECT_LT(smoothing(smooth, normals).cwiseAbs().maxCoeff(), 0.01);
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  Eigen::VectorXd ripples(ball.points.rows());
  for (double& ripple : ripples) ripple = 0.1 * normal(generator);
  const fem::Geometry<3> rough(ball.points + ripples.asDiagonal() * normals, ball.elements);
  const Eigen::VectorXd left = ripples + smoothing(rough, normals);
  EXPECT_LT(left.norm(), 0.4 * ripples.norm());
}

// Few steep places, as along an edge, are let be; the rest counts as in a least-squares spline.
TEST(SmoothMoves, WeighSteepPlacesLess) {
  const Triangles ball = mesh::ball(kCenter, kRadius, 2);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const BendingMatrices bending(geometry);
  const SmoothMoves<3> prior(bending, geometry, unit_normals(geometry), 8);
  Eigen::VectorXd moves = prior.smoothing();
  EXPECT_NEAR(prior.weights(moves, 10).minCoeff(), 4.0 / 3, 1e-9);
  moves[5] += 1;
  const Eigen::VectorXd weights = prior.weights(moves, 1000);
  EXPECT_LT(weights[5], 0.05);
  EXPECT_NEAR(weights.maxCoeff(), 4.0 / 3, 1e-9);
}

}  // namespace
}  // namespace surf::segment
