#include "libsurf/volume/screened_poisson.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "libsurf/base/log.h"
#include "libsurf/volume/detail/multigrid.h"

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

struct Solved {
  int n_iterations = 0;
  bool has_converged = false;
};

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

struct ScreenedPoisson::Impl {
  Impl(const Grid& grid, double mu, std::span<const double> the_I, double the_blend)
      : box{grid.size},
        I(the_I),
        blend(the_blend),
        metric(grid.index_to_world.linear()),
        mass(cell_matrix(full_moments(), metric, 1 / metric.volume, 0)),
        stiffness(cell_matrix(full_moments(), metric, 0, mu / metric.volume)),
        mu_metric(mu * metric.metric) {}

  std::size_t node(int i, int j, int k) const {
    return (std::size_t(k) * box.size[1] + j) * box.size[0] + i;
  }
  bool is_active_at(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < box.size[0] && j < box.size[1] && k < box.size[2] &&
           is_active[box.at(i, j, k)];
  }
  double value(int i, int j, int k) const { return e[box.at(i, j, k)] + I[node(i, j, k)]; }

  void start_from(const Impl& other, const std::array<int, 3>& shift);

  PaddedGrid box;
  std::span<const double> I;
  double blend;
  CellMetric metric;
  CellMatrix mass, stiffness;  // of a whole cell, over its volume
  Eigen::Matrix3d mu_metric;
  Values e;  // u - I
  std::vector<char> is_active;
  double energy = 0;
  Solved solved;
};

namespace {

/// In terms of the difference e = u - I, which does not feel a constant added to I:
/// (M + mu K) e = -mu K I = b, and J = constant - (b + r) . e / 2 with r the residual.
class Equations {
 public:
  Equations(const DomainCells& cells, const Eigen::Matrix3d& index_to_world, double mu,
            std::span<const double> I)
      : multigrid_(cells, index_to_world, mu), b_(A().box().n_values(), 0) {
    const PaddedGrid& box = A().box();
    Values padded(box.n_values());
    tbb::parallel_for(0, box.size[2], [&](int k) {
      std::size_t from = std::size_t(k) * box.size[0] * box.size[1];
      for (int j = 0; j < box.size[1]; ++j, from += box.size[0])
        std::copy_n(I.begin() + from, box.size[0], padded.begin() + box.at(0, j, k));
    });
    const CutMatrix K(cells, index_to_world, 0, mu);
    K.multiply(padded, b_);
    constant_ = dot(K, padded, b_) / 2;
    for_active(K, [&](std::size_t n) { b_[n] = A().is_active(n) ? -b_[n] : 0; });
  }

  const CutMatrix& A() const { return multigrid_.matrix(); }

  /// CG from e.
  Solved solve(const ScreenedPoissonOptions& options, Values& e) {
    const double target = options.tolerance * options.tolerance * scaled_square(A(), b_);
    r_.assign(b_.size(), 0);
    A().residual(b_, e, r_);
    Values z(b_.size()), p(b_.size()), Ap(b_.size());
    double rz = 0;
    for (int iteration = 0;; ++iteration) {
      if (scaled_square(A(), r_) <= target) return {iteration, true};
      if (iteration >= options.max_iterations) return {iteration, false};
      multigrid_.precondition(r_, z);
      const double previous = std::exchange(rz, dot(A(), r_, z));
      const double beta = iteration == 0 ? 0 : rz / previous;
      for_active(A(), [&](std::size_t n) { p[n] = z[n] + beta * p[n]; });
      A().multiply(p, Ap);
      const double curvature = dot(A(), p, Ap);
      if (!(curvature > 0)) return {iteration, false};
      const double alpha = rz / curvature;
      for_active(A(), [&](std::size_t n) {
        e[n] += alpha * p[n];
        r_[n] -= alpha * Ap[n];
      });
    }
  }

  double energy(const Values& e) const {
    return constant_ -
           sum_over_active(A(), [&](std::size_t n) { return (b_[n] + r_[n]) * e[n]; }) / 2;
  }

 private:
  Multigrid multigrid_;
  Values b_, r_;
  double constant_ = 0;
};

}  // namespace

/// What is not known there gets the mean of its neighbours' values, or I.
void ScreenedPoisson::Impl::start_from(const Impl& other, const std::array<int, 3>& shift) {
  tbb::parallel_for(0, box.size[2], [&](int k) {
    for (int j = 0; j < box.size[1]; ++j)
      for (int i = 0; i < box.size[0]; ++i) {
        const std::size_t at = box.at(i, j, k);
        if (!is_active[at]) continue;
        const int a = i + shift[0], b = j + shift[1], c = k + shift[2];
        if (other.is_active_at(a, b, c)) {
          e[at] = other.value(a, b, c) - I[node(i, j, k)];
          continue;
        }
        double sum = 0;
        int n = 0;
        for (int z = c - 1; z <= c + 1; ++z)
          for (int y = b - 1; y <= b + 1; ++y)
            for (int x = a - 1; x <= a + 1; ++x)
              if (other.is_active_at(x, y, z)) sum += other.value(x, y, z), ++n;
        if (n > 0) e[at] = sum / n - I[node(i, j, k)];
      }
  });
}

ScreenedPoisson::ScreenedPoisson(const DomainCells& cells, const Grid& grid, double mu,
                                 std::span<const double> I, const ScreenedPoissonOptions& options,
                                 const ScreenedPoisson* start, const std::array<int, 3>& shift)
    : impl_(std::make_unique<Impl>(grid, mu, I, options.blend)) {
  Equations equations(blended(cells, options.blend), grid.index_to_world.linear(), mu, I);
  impl_->e.assign(impl_->box.n_values(), 0);
  impl_->is_active.assign(impl_->box.n_values(), 0);
  for_active(equations.A(),
             [&](std::size_t n) { impl_->is_active[n] = equations.A().is_active(n); });
  if (start) impl_->start_from(*start->impl_, shift);
  impl_->solved = equations.solve(options, impl_->e);
  if (!impl_->solved.has_converged)
    log(LogLevel::kWarning,
        fmt::format("screened Poisson problem: the residual is above {:g} of the load after {} "
                    "iterations",
                    options.tolerance, impl_->solved.n_iterations));
  impl_->energy = equations.energy(impl_->e);
}

ScreenedPoisson::~ScreenedPoisson() = default;
ScreenedPoisson::ScreenedPoisson(ScreenedPoisson&&) noexcept = default;
ScreenedPoisson& ScreenedPoisson::operator=(ScreenedPoisson&&) noexcept = default;

double ScreenedPoisson::energy() const { return impl_->energy; }
int ScreenedPoisson::n_iterations() const { return impl_->solved.n_iterations; }
bool ScreenedPoisson::has_converged() const { return impl_->solved.has_converged; }

bool ScreenedPoisson::is_active(int i, int j, int k) const {
  return impl_->is_active[impl_->box.at(i, j, k)];
}

double ScreenedPoisson::node_value(int i, int j, int k) const { return impl_->value(i, j, k); }

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
  out.pointwise_ = 1 - impl_->blend;
  out.constant_ = impl_->blend * mean;
  return out;
}

}  // namespace surf::volume
