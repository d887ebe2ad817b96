#include "libcurve/energy/neumann.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <Eigen/IterativeLinearSolvers>
#include <array>
#include <cmath>
#include <functional>
#include <unordered_map>
#include <utility>

#include "libsurf/base/log.h"
#include "libsurf/base/products.h"
#include "libsurf/fem/p1.h"

namespace surf::curve {
namespace {

using Barycentric = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Gradients = Eigen::Matrix<double, 3, 2>;  // row i: gradient of phi_i
constexpr int kMostParts = 64;
constexpr int kGrain = 256;  // triangles

/// Points of the rule of order 2 on n^2 equal parts of a triangle; all weights are the same.
const Barycentric& rule(int n) {
  static const auto rules = [] {
    std::vector<Barycentric> out(kMostParts + 1);
    for (int parts = 1; parts <= kMostParts; ++parts) {
      Barycentric& b = out[parts];
      b.resize(3 * parts * parts, 3);
      Eigen::Index row = 0;
      const auto add = [&](const std::array<Eigen::Vector3d, 3>& corner) {
        for (int q = 0; q < 3; ++q)
          b.row(row++) =
              (4 * corner[q] + corner[(q + 1) % 3] + corner[(q + 2) % 3]) / (6.0 * parts);
      };
      const auto at = [&](int i, int j) { return Eigen::Vector3d(parts - i - j, i, j); };
      for (int i = 0; i < parts; ++i)
        for (int j = 0; i + j < parts; ++j) {
          add({at(i, j), at(i + 1, j), at(i, j + 1)});
          if (i + j + 1 < parts) add({at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)});
        }
    }
    return out;
  }();
  return rules[n];
}

struct Triangle {
  Eigen::Matrix<double, 3, 2> X;  // corners
  double area;
  Gradients gradients;

  Triangle(const DomainMesh& mesh, Eigen::Index t) {
    for (int i = 0; i < 3; ++i) X.row(i) = mesh.points.row(mesh.triangles(t, i));
    const Vector<2> a = X.row(1) - X.row(0), b = X.row(2) - X.row(0);
    area = cross(a, b) / 2;
    gradients = fem::p1_gradients<3, 2>(X);
  }
};

template <class Body>
void for_triangles(Eigen::Index n, const Body& body) {
  tbb::parallel_for(
      tbb::blocked_range<Eigen::Index>(0, n, kGrain),
      [&](const auto& range) {
        for (Eigen::Index t = range.begin(); t != range.end(); ++t) body(t);
      },
      tbb::simple_partitioner());
}

struct Batch {
  Points<2> points;
  Samples<2> samples;
};

void integrate(const Triangle& T, const Field<2>& I, const NeumannOptions& options, Eigen::Index t,
               ImageIntegrals& out) {
  thread_local Batch batch;
  const Barycentric& b = rule(out.parts[t]);
  batch.points.resize(b.rows() + 3, 2);
  batch.points.topRows(b.rows()).noalias() = b.lazyProduct(T.X);
  batch.points.bottomRows<3>() = T.X;
  I.sample(batch.points, Derivatives::kNone, batch.samples);
  auto& values = batch.samples.value;
  values.array() = (values.array() - options.offset) / options.scale;
  const double weight = T.area / double(b.rows());
  const Eigen::Vector3d corners = values.tail<3>();
  Eigen::Vector3d loads = Eigen::Vector3d::Zero();
  double error = 0;
  for (Eigen::Index q = 0; q < b.rows(); ++q) {
    loads += values[q] * b.row(q).transpose();
    const double off = values[q] - b.row(q).dot(corners);
    error += off * off;
  }
  out.loads.row(t) = weight * loads;
  out.errors[t] = weight * error;
}

/// The corners of a triangle, from the first one by coordinates on.
using Corners = std::array<double, 6>;

int first_corner(const DomainMesh& mesh, Eigen::Index t) {
  int first = 0;
  const auto at = [&](int i) {
    const int node = mesh.triangles(t, i);
    return std::pair(mesh.points(node, 0), mesh.points(node, 1));
  };
  for (int i = 1; i < 3; ++i)
    if (at(i) < at(first)) first = i;
  return first;
}

Corners corners_of(const DomainMesh& mesh, Eigen::Index t) {
  const int first = first_corner(mesh, t);
  Corners out;
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 2; ++axis)
      out[2 * i + axis] = mesh.points(mesh.triangles(t, (first + i) % 3), axis);
  return out;
}

/// By how many places corner 0 of triangle t is further on in triangle s of the other mesh.
int rotation(const DomainMesh& mesh, Eigen::Index t, const DomainMesh& other, Eigen::Index s) {
  return (first_corner(other, s) - first_corner(mesh, t) + 3) % 3;
}

struct CornersHash {
  std::size_t operator()(const Corners& corners) const {
    std::size_t hash = 0;
    for (const double x : corners) hash = hash * 0x9E3779B97F4A7C15U + std::hash<double>()(x);
    return hash;
  }
};

}  // namespace

Unknowns unknowns(const DomainMesh& mesh) {
  Unknowns out;
  out.of_node.setConstant(mesh.points.rows(), 2, -1);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int i = 0; i < 3; ++i) out.of_node(mesh.triangles(t, i), int(mesh.is_inside[t])) = 0;
  for (Eigen::Index i = 0; i < out.of_node.size(); ++i)
    if (out.of_node.data()[i] == 0) out.of_node.data()[i] = out.size++;
  return out;
}

ImageIntegrals image_integrals(const DomainMesh& mesh, const Field<2>& I,
                               const NeumannOptions& options, const DomainMesh* last_mesh,
                               const ImageIntegrals* last) {
  std::unordered_map<Corners, int, CornersHash> known;
  if (last) {
    known.reserve(2 * last->parts.size());
    for (Eigen::Index t = 0; t < last_mesh->triangles.rows(); ++t)
      known.emplace(corners_of(*last_mesh, t), int(t));
  }
  const Eigen::Index n = mesh.triangles.rows();
  ImageIntegrals out{{n, 3}, Eigen::VectorXd(n), std::vector<int>(n)};
  for_triangles(n, [&](Eigen::Index t) {
    const auto at = known.find(corners_of(mesh, t));
    if (at != known.end()) {
      out.parts[t] = last->parts[at->second];
      out.errors[t] = last->errors[at->second];
      // The triangle may begin with another corner.
      const int shift = rotation(mesh, t, *last_mesh, at->second);
      for (int i = 0; i < 3; ++i) out.loads(t, i) = last->loads(at->second, (i + shift) % 3);
      return;
    }
    const Triangle T(mesh, t);
    double longest = 0;
    for (int i = 0; i < 3; ++i)
      longest = std::max(longest, (T.X.row(i) - T.X.row((i + 1) % 3)).norm());
    out.parts[t] = std::clamp(int(std::ceil(longest / options.spacing_mm)), 1, kMostParts);
    integrate(T, I, options, t, out);
  });
  return out;
}

Neumann::Neumann(DomainMesh mesh, ImageIntegrals integrals, std::shared_ptr<const Field<2>> I,
                 const NeumannOptions& options, const Eigen::VectorXd& start)
    : mesh_(std::move(mesh)),
      I_(std::move(I)),
      options_(options),
      unknowns_(curve::unknowns(mesh_)),
      integrals_(std::move(integrals)) {
  solve(start);
}

Neumann Neumann::moved_to(const Points<2>& points) const {
  Neumann out;
  out.mesh_ = mesh_;
  out.mesh_.points = points;
  out.I_ = I_;
  out.options_ = options_;
  out.unknowns_ = unknowns_;
  out.integrals_ = integrals_;
  for_triangles(mesh_.triangles.rows(), [&](Eigen::Index t) {
    for (const int i : mesh_.triangles.row(t))
      if (points.row(i) != mesh_.points.row(i)) {
        integrate(Triangle(out.mesh_, t), *I_, options_, t, out.integrals_);
        return;
      }
  });
  out.solve(u_);
  return out;
}

std::array<int, 3> Neumann::unknowns_of(Eigen::Index t) const {
  std::array<int, 3> out;
  for (int i = 0; i < 3; ++i)
    out[i] = unknowns_.of_node(mesh_.triangles(t, i), int(mesh_.is_inside[t]));
  return out;
}

Eigen::SparseMatrix<double> Neumann::matrix() const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * mesh_.triangles.rows());
  for (Eigen::Index t = 0; t < mesh_.triangles.rows(); ++t) {
    const Triangle T(mesh_, t);
    const auto dofs = unknowns_of(t);
    const Eigen::Matrix3d K =
        options_.mu * fem::p1_stiffness(T.gradients, T.area) + fem::p1_mass<3>(T.area);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) entries.emplace_back(dofs[i], dofs[j], K(i, j));
  }
  Eigen::SparseMatrix<double> out(unknowns_.size, unknowns_.size);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

Eigen::VectorXd Neumann::intensity(const Points<2>& points) const {
  Samples<2> samples;
  I_->sample(points, Derivatives::kNone, samples);
  return (samples.value.array() - options_.offset) / options_.scale;
}

void Neumann::solve(const Eigen::VectorXd& start) {
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(unknowns_.size);
  for (Eigen::Index t = 0; t < mesh_.triangles.rows(); ++t) {
    const auto dofs = unknowns_of(t);
    for (int i = 0; i < 3; ++i) rhs[dofs[i]] += integrals_.loads(t, i);
  }
  const Eigen::SparseMatrix<double> K = matrix();
  Eigen::ConjugateGradient<
      Eigen::SparseMatrix<double>, Eigen::Lower,
      Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>>>
      solver;
  solver.setTolerance(options_.tolerance);
  solver.setMaxIterations(2000);
  solver.compute(K);
  u_ = start.size() == rhs.size() ? Eigen::VectorXd(solver.solveWithGuess(rhs, start))
                                  : Eigen::VectorXd(solver.solve(rhs));
  n_iterations_ = int(solver.iterations());
  if (solver.info() != Eigen::Success)
    log(LogLevel::kWarning,
        fmt::format("Neumann problems: the residual is {:.1e} of the load after {} iterations, not "
                    "{:g}",
                    solver.error(), n_iterations_, options_.tolerance));
  energy_ = 0.5 * u_.dot(K.selfadjointView<Eigen::Lower>() * u_) - rhs.dot(u_);
}

/// With V = phi_k delta on a triangle: d area = area grad phi_k . delta, d grad u = -grad phi_k
/// (delta . grad u), d I(x) = grad I . delta phi_k.
Points<2> Neumann::gradient(const std::vector<char>& asked) const {
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> parts;
  parts.setZero(mesh_.triangles.rows(), 6);
  for_triangles(mesh_.triangles.rows(), [&](Eigen::Index t) {
    const auto nodes = mesh_.triangles.row(t);
    if (!asked.empty() && !asked[nodes[0]] && !asked[nodes[1]] && !asked[nodes[2]]) return;
    thread_local Batch batch;
    const Triangle T(mesh_, t);
    const Barycentric& b = rule(integrals_.parts[t]);
    batch.points.noalias() = b.lazyProduct(T.X);
    I_->sample(batch.points, Derivatives::kFirst, batch.samples);
    const auto dofs = unknowns_of(t);
    const Eigen::Vector3d u(u_[dofs[0]], u_[dofs[1]], u_[dofs[2]]);
    const double weight = T.area / double(b.rows());
    const Eigen::VectorXd u_q = b * u;
    const double mean_Iu =
        u_q.dot(((batch.samples.value.array() - options_.offset) / options_.scale).matrix()) /
        double(b.rows());
    const double mean_uu = (u.squaredNorm() + u.sum() * u.sum()) / 12;
    const Vector<2> grad = T.gradients.transpose() * u;
    const double density = T.area * (options_.mu / 2 * grad.squaredNorm() + mean_uu / 2 - mean_Iu);
    const Gradients I_part =
        weight / options_.scale *
        (b.transpose() *
         (u_q.asDiagonal() * Eigen::Matrix<double, Eigen::Dynamic, 2>(batch.samples.gradient)));
    for (int k = 0; k < 3; ++k) {
      const Vector<2> g = T.gradients.row(k);
      const Vector<2> d =
          density * g - T.area * options_.mu * grad.dot(g) * grad - I_part.row(k).transpose();
      parts(t, 2 * k) = d[0];
      parts(t, 2 * k + 1) = d[1];
    }
  });
  Points<2> out = Points<2>::Zero(mesh_.points.rows(), 2);
  for (Eigen::Index t = 0; t < mesh_.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) out.row(mesh_.triangles(t, k)) += parts.row(t).segment<2>(2 * k);
  return out;
}

std::array<double, 2> Neumann::means() const {
  std::array<double, 2> sum = {0, 0}, area = {0, 0};
  for (Eigen::Index t = 0; t < mesh_.triangles.rows(); ++t) {
    const double here = Triangle(mesh_, t).area;
    const auto dofs = unknowns_of(t);
    area[mesh_.is_inside[t]] += here;
    sum[mesh_.is_inside[t]] += here * (u_[dofs[0]] + u_[dofs[1]] + u_[dofs[2]]) / 3;
  }
  return {area[0] > 0 ? sum[0] / area[0] : 0, area[1] > 0 ? sum[1] / area[1] : 0};
}

}  // namespace surf::curve
