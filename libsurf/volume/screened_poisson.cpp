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

struct Solved {
  int n_iterations = 0;
  bool has_converged = false;
};

/// CG from x for A x = b, with one multigrid cycle as preconditioner; r becomes the residual.
Solved solve_by_cg(Multigrid& multigrid, const ScreenedPoissonOptions& options, const Values& b,
                   Values& x, Values& r) {
  const CutMatrix& A = multigrid.matrix();
  const double target = options.tolerance * options.tolerance * scaled_square(A, b);
  r.assign(b.size(), 0);
  A.residual(b, x, r);
  Values z(b.size()), p(b.size()), Ap(b.size());
  double rz = 0;
  for (int iteration = 0;; ++iteration) {
    if (scaled_square(A, r) <= target) return {iteration, true};
    if (iteration >= options.max_iterations) return {iteration, false};
    multigrid.precondition(r, z);
    const double previous = std::exchange(rz, dot(A, r, z));
    const double beta = iteration == 0 ? 0 : rz / previous;
    for_active(A, [&](std::size_t n) { p[n] = z[n] + beta * p[n]; });
    A.multiply(p, Ap);
    const double curvature = dot(A, p, Ap);
    if (!(curvature > 0)) return {iteration, false};
    const double alpha = rz / curvature;
    for_active(A, [&](std::size_t n) {
      x[n] += alpha * p[n];
      r[n] -= alpha * Ap[n];
    });
  }
}

void warn_unless_converged(const Solved& solved, const ScreenedPoissonOptions& options) {
  if (solved.has_converged) return;
  log(LogLevel::kWarning,
      fmt::format("screened Poisson problem: the residual is above {:g} of the load after {} "
                  "iterations",
                  options.tolerance, solved.n_iterations));
}

/// Values at the nodes of a grid, i fastest, with the margin of zeros.
Values padded(std::span<const double> values, const PaddedGrid& box) {
  Values out(box.n_values());
  tbb::parallel_for(0, box.size[2], [&](int k) {
    std::size_t from = std::size_t(k) * box.size[0] * box.size[1];
    for (int j = 0; j < box.size[1]; ++j, from += box.size[0])
      std::copy_n(values.begin() + from, box.size[0], out.begin() + box.at(0, j, k));
  });
  return out;
}

}  // namespace

double CellDensity::difference(const Eigen::Vector3d& x) const {
  const auto weights = fem::trilinear_values(x);
  double sum = 0;
  for (int a = 0; a < 8; ++a) sum += weights[a] * e_[a];
  return sum;
}

double CellDensity::operator()(const Eigen::Vector3d& x) const {
  const double e = difference(x);
  const Eigen::Vector3d d = slope(x);
  return pointwise_ * (e * e + d.dot(metric_ * d)) / 2 + constant_;
}

Eigen::Vector3d CellDensity::slope(const Eigen::Vector3d& x) const {
  const auto slopes = fem::trilinear_slopes(x);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int a = 0; a < 8; ++a) sum += u_[a] * slopes[a];
  return sum;
}

Eigen::Matrix<double, 8, 1> CellDensity::by_corner(const Eigen::Vector3d& x) const {
  const auto weights = fem::trilinear_values(x);
  const auto slopes = fem::trilinear_slopes(x);
  const double e = difference(x);
  const Eigen::Vector3d flux = metric_ * slope(x);
  Eigen::Matrix<double, 8, 1> out = constant_by_corner_;
  for (int a = 0; a < 8; ++a) out[a] += pointwise_ * (e * weights[a] + flux.dot(slopes[a]));
  return out;
}

struct ScreenedPoisson::Impl {
  Impl(const Grid& grid, double mu, std::span<const double> the_I, double the_blend)
      : box{grid.size},
        I(the_I),
        blend(the_blend),
        metric(grid.index_to_world.linear()),
        mass(fem::cell_matrix(fem::full_moments(), metric, 1 / metric.volume, 0)),
        stiffness(fem::cell_matrix(fem::full_moments(), metric, 0, mu / metric.volume)),
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
  fem::CellMetric metric;
  fem::CellMatrix mass, stiffness;  // of a whole cell, over its volume
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
      : multigrid_(cells, index_to_world, mu), b_(matrix().box().n_values(), 0) {
    const Values at_nodes = padded(I, matrix().box());
    const CutMatrix K(cells, index_to_world, 0, mu);
    K.multiply(at_nodes, b_);
    constant_ = dot(K, at_nodes, b_) / 2;
    for_active(K, [&](std::size_t n) { b_[n] = matrix().is_active(n) ? -b_[n] : 0; });
  }

  const CutMatrix& matrix() const { return multigrid_.matrix(); }

  /// From e on.
  Solved solve(const ScreenedPoissonOptions& options, Values& e) {
    return solve_by_cg(multigrid_, options, b_, e, r_);
  }

  double energy(const Values& e) const {
    return constant_ -
           sum_over_active(matrix(), [&](std::size_t n) { return (b_[n] + r_[n]) * e[n]; }) / 2;
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
  for_active(equations.matrix(),
             [&](std::size_t n) { impl_->is_active[n] = equations.matrix().is_active(n); });
  if (start) impl_->start_from(*start->impl_, shift);
  impl_->solved = equations.solve(options, impl_->e);
  warn_unless_converged(impl_->solved, options);
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
  const Eigen::Matrix<double, 8, 1> of_e = impl_->mass * e, of_u = impl_->stiffness * u;
  out.pointwise_ = 1 - impl_->blend;
  out.constant_ = impl_->blend * (e.dot(of_e) + u.dot(of_u)) / 2;
  out.constant_by_corner_ = impl_->blend * (of_e + of_u);
  return out;
}

struct ScreenedPoissonInverse::Impl {
  Impl(const DomainCells& cells, const Grid& grid, double mu,
       const ScreenedPoissonOptions& the_options)
      : options(the_options),
        multigrid(blended(cells, options.blend), grid.index_to_world.linear(), mu) {}

  ScreenedPoissonOptions options;
  Multigrid multigrid;
};

ScreenedPoissonInverse::ScreenedPoissonInverse(const DomainCells& cells, const Grid& grid,
                                               double mu, const ScreenedPoissonOptions& options)
    : impl_(std::make_unique<Impl>(cells, grid, mu, options)) {}

ScreenedPoissonInverse::~ScreenedPoissonInverse() = default;
ScreenedPoissonInverse::ScreenedPoissonInverse(ScreenedPoissonInverse&&) noexcept = default;

Eigen::VectorXd ScreenedPoissonInverse::operator()(const Eigen::VectorXd& load) const {
  const CutMatrix& A = impl_->multigrid.matrix();
  const PaddedGrid& box = A.box();
  const std::array<int, 3>& size = box.size;
  Values b = padded({load.data(), std::size_t(load.size())}, box), x(b.size()), r;
  for (std::size_t n = 0; n < b.size(); ++n)
    if (!A.is_active(n)) b[n] = 0;
  warn_unless_converged(solve_by_cg(impl_->multigrid, impl_->options, b, x, r), impl_->options);
  Eigen::VectorXd out(load.size());
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      std::copy_n(x.begin() + std::ptrdiff_t(box.at(0, j, k)), size[0],
                  out.data() + (std::ptrdiff_t(k) * size[1] + j) * size[0]);
  return out;
}

}  // namespace surf::volume
