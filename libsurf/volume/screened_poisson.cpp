#include "libsurf/volume/screened_poisson.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <utility>

#include "libsurf/volume/multigrid.h"

namespace surf::volume {
namespace {

/// Sum over the active nodes, slab by slab in their order.
template <class Term>
double sum_over_active(const CutMatrix& matrix, const Term& term) {
  std::vector<double> of_slabs(matrix.box().size[2]);
  tbb::parallel_for(std::size_t(0), of_slabs.size(), [&](std::size_t k) {
    double sum = 0;
    for (const NodeRange& range : matrix.active(int(k)))
      for (std::size_t n = range.begin; n < range.begin + range.n; ++n) sum += term(n);
    of_slabs[k] = sum;
  });
  double sum = 0;
  for (const double part : of_slabs) sum += part;
  return sum;
}

template <class Visit>
void for_active(const CutMatrix& matrix, const Visit& visit) {
  tbb::parallel_for(0, matrix.box().size[2], [&](int k) {
    for (const NodeRange& range : matrix.active(k))
      for (std::size_t n = range.begin; n < range.begin + range.n; ++n) visit(n);
  });
}

double dot(const CutMatrix& matrix, const Values& a, const Values& b) {
  return sum_over_active(matrix, [&](std::size_t n) { return a[n] * b[n]; });
}

double scaled_square(const CutMatrix& matrix, const Values& r) {
  const Values& scale = matrix.inverse_scale();
  return sum_over_active(matrix, [&](std::size_t n) { return scale[n] * r[n] * r[n]; });
}

/// Trilinear weights of the corners, and their derivatives.
std::array<double, 8> corner_weights(const Eigen::Vector3d& x) {
  std::array<double, 8> out;
  for (int a = 0; a < 8; ++a)
    out[a] = (a & 1 ? x[0] : 1 - x[0]) * (a & 2 ? x[1] : 1 - x[1]) * (a & 4 ? x[2] : 1 - x[2]);
  return out;
}

Eigen::Vector3d slope(const std::array<double, 8>& u, const Eigen::Vector3d& x) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (int a = 0; a < 8; ++a) {
    const double wx = a & 1 ? x[0] : 1 - x[0], wy = a & 2 ? x[1] : 1 - x[1],
                 wz = a & 4 ? x[2] : 1 - x[2];
    out += u[a] * Eigen::Vector3d((a & 1 ? 1 : -1) * wy * wz, wx * (a & 2 ? 1 : -1) * wz,
                                  wx * wy * (a & 4 ? 1 : -1));
  }
  return out;
}

}  // namespace

double CellDensity::difference(const Eigen::Vector3d& x) const {
  const auto weights = corner_weights(x);
  double sum = 0;
  for (int a = 0; a < 8; ++a) sum += weights[a] * e_[a];
  return sum;
}

double CellDensity::operator()(const Eigen::Vector3d& x) const {
  const double e = difference(x);
  const Eigen::Vector3d d = slope(u_, x);
  return pointwise_ * (e * e + d.dot(metric_ * d)) / 2 + constant_;
}

/// In terms of the difference e = u - I, which does not feel a constant added to I:
/// (M + mu K) e = -mu K I = b, and J = constant - (b + r) . e / 2 with r the residual.
struct ScreenedPoisson::Impl {
  Impl(std::shared_ptr<const DomainCells> the_cells, const Grid& the_grid, double mu,
       std::span<const double> the_I, const ScreenedPoissonOptions& the_options)
      : size(the_grid.size),
        I(the_I),
        options(the_options),
        metric(the_grid.index_to_world.linear()),
        mass(cell_matrix(full_moments(), metric, 1 / metric.volume, 0)),
        stiffness(cell_matrix(full_moments(), metric, 0, mu / metric.volume)),
        mu_metric(mu * metric.metric),
        multigrid(blended(*the_cells, the_options.blend), the_grid.index_to_world.linear(), mu) {
    const NodeBox& box = multigrid.matrix().box();
    for (Values* values : {&e, &b, &r}) values->assign(box.n_values(), 0);
    Values padded(box.n_values());
    tbb::parallel_for(0, size[2], [&](int k) {
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) padded[box.at(i, j, k)] = I[node(i, j, k)];
    });
    const CutMatrix K(blended(*the_cells, the_options.blend), the_grid.index_to_world.linear(), 0, mu);
    K.multiply(padded, b);
    constant = dot(K, padded, b) / 2;
    const CutMatrix& matrix = multigrid.matrix();
    for_active(K, [&](std::size_t n) { b[n] = matrix.is_active(n) ? -b[n] : 0; });
    r = b;
  }

  std::size_t node(int i, int j, int k) const {
    return (std::size_t(k) * size[1] + j) * size[0] + i;
  }

  std::array<int, 3> size;
  std::span<const double> I;
  ScreenedPoissonOptions options;
  CellMetric metric;
  CellMatrix mass, stiffness;  // of a whole cell, over its volume
  Eigen::Matrix3d mu_metric;
  Multigrid multigrid;
  Values e, b, r;
  double constant = 0;
};

ScreenedPoisson::ScreenedPoisson(std::shared_ptr<const DomainCells> cells, const Grid& grid,
                                 double mu, std::span<const double> I,
                                 const ScreenedPoissonOptions& options)
    : impl_(std::make_unique<Impl>(std::move(cells), grid, mu, I, options)) {}

ScreenedPoisson::~ScreenedPoisson() = default;
ScreenedPoisson::ScreenedPoisson(ScreenedPoisson&&) noexcept = default;

void ScreenedPoisson::start_from(const ScreenedPoisson& other, const std::array<int, 3>& shift) {
  const CutMatrix& matrix = impl_->multigrid.matrix();
  const NodeBox &box = matrix.box(), &there = other.impl_->multigrid.matrix().box();
  const auto known = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < there.size[0] && j < there.size[1] &&
           k < there.size[2] && other.impl_->multigrid.matrix().is_active(there.at(i, j, k));
  };
  const auto value = [&](int i, int j, int k) {
    return other.impl_->e[there.at(i, j, k)] + other.impl_->I[other.impl_->node(i, j, k)];
  };
  tbb::parallel_for(0, box.size[2], [&](int k) {
    for (int j = 0; j < box.size[1]; ++j)
      for (int i = 0; i < box.size[0]; ++i) {
        const std::size_t at = box.at(i, j, k);
        if (!matrix.is_active(at)) continue;
        const int a = i + shift[0], b = j + shift[1], c = k + shift[2];
        const double I = impl_->I[impl_->node(i, j, k)];
        if (known(a, b, c)) {
          impl_->e[at] = value(a, b, c) - I;
          continue;
        }
        double sum = 0;
        int n = 0;
        for (int z = c - 1; z <= c + 1; ++z)
          for (int y = b - 1; y <= b + 1; ++y)
            for (int x = a - 1; x <= a + 1; ++x)
              if (known(x, y, z)) sum += value(x, y, z), ++n;
        impl_->e[at] = n > 0 ? sum / n - I : 0;
      }
  });
}

int ScreenedPoisson::solve() {
  const CutMatrix& A = impl_->multigrid.matrix();
  Values &e = impl_->e, &r = impl_->r;
  const double target =
      impl_->options.tolerance * impl_->options.tolerance * scaled_square(A, impl_->b);
  A.residual(impl_->b, e, r);
  Values z(r.size()), p(r.size()), Ap(r.size());
  double rz = 0;
  for (int iteration = 0; iteration < impl_->options.max_iterations; ++iteration) {
    if (scaled_square(A, r) <= target) return iteration;
    impl_->multigrid.precondition(r, z);
    const double previous = std::exchange(rz, dot(A, r, z));
    const double beta = iteration == 0 ? 0 : rz / previous;
    for_active(A, [&](std::size_t n) { p[n] = z[n] + beta * p[n]; });
    A.multiply(p, Ap);
    const double curvature = dot(A, p, Ap);
    if (!(curvature > 0)) return iteration;
    const double alpha = rz / curvature;
    for_active(A, [&](std::size_t n) {
      e[n] += alpha * p[n];
      r[n] -= alpha * Ap[n];
    });
  }
  return impl_->options.max_iterations;
}

double ScreenedPoisson::energy() const {
  const Values &e = impl_->e, &b = impl_->b, &r = impl_->r;
  return impl_->constant - sum_over_active(impl_->multigrid.matrix(), [&](std::size_t n) {
                             return (b[n] + r[n]) * e[n];
                           }) / 2;
}

bool ScreenedPoisson::is_active(int i, int j, int k) const {
  const CutMatrix& matrix = impl_->multigrid.matrix();
  return matrix.is_active(matrix.box().at(i, j, k));
}

double ScreenedPoisson::node_value(int i, int j, int k) const {
  return impl_->e[impl_->multigrid.matrix().box().at(i, j, k)] + impl_->I[impl_->node(i, j, k)];
}

std::array<double, 8> ScreenedPoisson::corner_values(int i, int j, int k) const {
  std::array<double, 8> values{};
  int n_known = 0;
  std::array<bool, 8> known{};
  for (int a = 0; a < 8; ++a) {
    const std::array<int, 3> at = {i + (a & 1), j + (a >> 1 & 1), k + (a >> 2)};
    known[a] = is_active(at[0], at[1], at[2]);
    n_known += known[a];
    values[a] = node_value(at[0], at[1], at[2]);
  }
  while (n_known > 0 && n_known < 8) {
    const auto were = known;
    for (int a = 0; a < 8; ++a) {
      if (were[a]) continue;
      double sum = 0;
      int n = 0;
      for (const int b : {a ^ 1, a ^ 2, a ^ 4})
        if (were[b]) sum += values[b], ++n;
      if (n == 0) continue;
      values[a] = sum / n;
      known[a] = true;
      ++n_known;
    }
  }
  return values;
}

CellDensity ScreenedPoisson::density(int i, int j, int k) const {
  CellDensity out;
  out.u_ = corner_values(i, j, k);
  for (int a = 0; a < 8; ++a)
    out.e_[a] = out.u_[a] - impl_->I[impl_->node(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2))];
  out.metric_ = impl_->mu_metric;
  const Eigen::Map<const Eigen::Matrix<double, 8, 1>> u(out.u_.data()), e(out.e_.data());
  const double mean = (e.dot(impl_->mass * e) + u.dot(impl_->stiffness * u)) / 2;
  out.pointwise_ = 1 - impl_->options.blend;
  out.constant_ = impl_->options.blend * mean;
  return out;
}

}  // namespace surf::volume
