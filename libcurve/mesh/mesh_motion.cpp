#include "libcurve/mesh/mesh_motion.h"

#include <cmath>

#include "libsurf/base/products.h"
#include "libsurf/fem/p1.h"

namespace surf::curve {
namespace {

constexpr double kTolerance = 1e-12;  // of the relative residual: both maps are then one another's
constexpr int kMostIterations = 500;

/// Rings round the curves: 0 on them, -1 beyond the last one and on the box's border.
std::vector<int> rings(const DomainMesh& mesh, int n_rings) {
  std::vector<int> ring(mesh.points.rows(), -1);
  for (const TraceEdge& edge : mesh.trace) ring[edge.start] = ring[edge.end] = 0;
  for (int r = 1; r <= n_rings; ++r)
    for (const auto t : mesh.triangles.rowwise())
      for (int i = 0; i < 3; ++i)
        if (ring[t[i]] == r - 1)
          for (int j = 0; j < 3; ++j)
            if (ring[t[j]] < 0 && !mesh.is_on_border[t[j]]) ring[t[j]] = r;
  return ring;
}

Eigen::Matrix3d stiffness(const DomainMesh& mesh, Eigen::Index t) {
  Eigen::Matrix<double, 3, 2> X;
  for (int i = 0; i < 3; ++i) X.row(i) = mesh.points.row(mesh.triangles(t, i));
  const Vector<2> a = X.row(1) - X.row(0), b = X.row(2) - X.row(0);
  return fem::p1_stiffness(fem::p1_gradients<3, 2>(X), cross(a, b) / 2);
}

}  // namespace

MeshMotion::MeshMotion(const DomainMesh& mesh, const Elements<2>& elements, Eigen::Index n_vertices,
                       int n_rings)
    : mesh_(mesh), n_vertices_(n_vertices) {
  for (const TraceEdge& edge : mesh.trace) {
    const int a = elements(edge.element, 0), b = elements(edge.element, 1);
    if (edge.to == 1) {
      shares_.push_back({edge.end, b, 1});
    } else {
      shares_.push_back({edge.end, a, 1 - edge.to});
      shares_.push_back({edge.end, b, edge.to});
    }
  }
  const std::vector<int> ring = rings(mesh, n_rings);
  std::vector<int> number(ring.size(), -1);
  for (std::size_t i = 0; i < ring.size(); ++i)
    if (ring[i] > 0) {
      number[i] = int(mobile_.size());
      mobile_.push_back(int(i));
    }
  std::vector<Eigen::Triplet<double>> inner, coupling;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const auto nodes = mesh.triangles.row(t);
    if (number[nodes[0]] < 0 && number[nodes[1]] < 0 && number[nodes[2]] < 0) continue;
    const Eigen::Matrix3d A = stiffness(mesh, t);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3 && number[nodes[i]] >= 0; ++j) {
        if (number[nodes[j]] >= 0)
          inner.emplace_back(number[nodes[i]], number[nodes[j]], A(i, j));
        else if (ring[nodes[j]] == 0)
          coupling.emplace_back(number[nodes[i]], nodes[j], A(i, j));
      }
  }
  const Eigen::Index n = Eigen::Index(mobile_.size());
  inner_.resize(n, n);
  inner_.setFromTriplets(inner.begin(), inner.end());
  coupling_.resize(n, mesh.points.rows());
  coupling_.setFromTriplets(coupling.begin(), coupling.end());
  inverse_diagonal_ = inner_.diagonal().cwiseInverse();
}

/// Conjugate gradients with the diagonal as preconditioner, both columns at once: a few rings make
/// a well-conditioned system.
Points<2> MeshMotion::solved(const Points<2>& rhs) const {
  Points<2> x = Points<2>::Zero(rhs.rows(), 2), r = rhs;
  Points<2> z = inverse_diagonal_.asDiagonal() * r, p = z;
  Eigen::Array2d rz = r.cwiseProduct(z).colwise().sum();
  const Eigen::Array2d small = kTolerance * kTolerance * rz;
  for (int k = 0; k < kMostIterations && (rz > small).any(); ++k) {
    const Points<2> q = inner_ * p;
    const Eigen::Array2d pq = p.cwiseProduct(q).colwise().sum();
    const Eigen::Array2d step = (rz > small).select(rz / pq, 0);
    x += p * step.matrix().asDiagonal();
    r -= q * step.matrix().asDiagonal();
    z = inverse_diagonal_.asDiagonal() * r;
    const Eigen::Array2d next = r.cwiseProduct(z).colwise().sum();
    const Eigen::Array2d ratio = (rz > small).select(next / rz, 0);
    p = z + p * ratio.matrix().asDiagonal();
    rz = next;
  }
  return x;
}

Points<2> MeshMotion::moved(const Points<2>& displacement) const {
  Points<2> out = Points<2>::Zero(mesh_.points.rows(), 2);
  for (const Share& share : shares_)
    out.row(share.node) += share.weight * displacement.row(share.vertex);
  const Points<2> inner = solved(-(coupling_ * out));
  for (std::size_t i = 0; i < mobile_.size(); ++i) out.row(mobile_[i]) = inner.row(Eigen::Index(i));
  return mesh_.points + out;
}

std::vector<char> MeshMotion::moving() const {
  std::vector<char> out(mesh_.points.rows(), 0);
  for (const Share& share : shares_) out[share.node] = 1;
  for (const int node : mobile_) out[node] = 1;
  return out;
}

Points<2> MeshMotion::transposed(const Points<2>& of_nodes) const {
  Points<2> inner(Eigen::Index(mobile_.size()), 2);
  for (std::size_t i = 0; i < mobile_.size(); ++i)
    inner.row(Eigen::Index(i)) = of_nodes.row(mobile_[i]);
  const Points<2> on_curves = of_nodes - coupling_.transpose() * solved(inner);
  Points<2> out = Points<2>::Zero(n_vertices_, 2);
  for (const Share& share : shares_)
    out.row(share.vertex) += share.weight * on_curves.row(share.node);
  return out;
}

}  // namespace surf::curve
