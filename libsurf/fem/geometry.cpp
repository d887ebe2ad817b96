#include "libsurf/fem/geometry.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>

#include "libsurf/base/error.h"
#include "libsurf/fem/p1.h"

namespace surf::fem {
namespace {

/// measure * nu: the rotated edge of a segment, half the cross product of a triangle.
Vector<2> area_vector(const Points<2>& X, const Eigen::RowVector2i& t) {
  const Vector<2> edge = X.row(t[1]) - X.row(t[0]);
  return {edge[1], -edge[0]};
}
Vector<3> area_vector(const Points<3>& X, const Eigen::RowVector3i& t) {
  const Vector<3> a = X.row(t[1]) - X.row(t[0]);
  const Vector<3> b = X.row(t[2]) - X.row(t[0]);
  return a.cross(b) / 2;
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> corners(const Points<Dim>& X, const Eigen::Matrix<int, 1, Dim>& t) {
  Eigen::Matrix<double, Dim, Dim> out;
  for (int i = 0; i < Dim; ++i) out.row(i) = X.row(t[i]);
  return out;
}

constexpr double kLongestMove = 2;  // along the border, of a normal one

/// The part d of a normal n in the planes of some normals, scaled so that d . n = 1.
template <int Dim>
Vector<Dim> along_border(Vector<Dim> n, const Points<Dim>& normals, std::uint8_t planes) {
  std::vector<Vector<Dim>> basis;
  for (Eigen::Index p = 0; p < normals.rows(); ++p) {
    if (!(planes >> p & 1)) continue;
    Vector<Dim> more = normals.row(p);
    for (const Vector<Dim>& one : basis) more -= one.dot(more) * one;
    if (!(more.norm() > 1e-6)) continue;
    basis.push_back(more.normalized());
    n -= basis.back().dot(n) * basis.back();
  }
  if (int(basis.size()) == Dim) return Vector<Dim>::Zero();  // in a corner
  return n * std::min(1 / std::max(n.squaredNorm(), 1e-300), kLongestMove * kLongestMove);
}

/// Zeros, with an entry for each pair of vertices of an element. Sorted row by row: 2.3 ms for
/// 33,620 triangles, 12.9 from triplets, which took 12 % of a run on a scan.
template <int Dim>
SparseMatrix pattern_of(const Elements<Dim>& T, Eigen::Index n_vertices) {
  std::vector<int> first(n_vertices + 1, 0);  // of each row, with repetitions
  for (const int vertex : T.reshaped()) first[vertex + 1] += Dim;
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<int> columns(first.back()), end = first;
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) columns[end[T(t, i)]++] = T(t, j);
  tbb::parallel_for(Eigen::Index(0), n_vertices, [&](Eigen::Index row) {
    const auto begin = columns.begin() + first[row];
    std::sort(begin, columns.begin() + first[row + 1]);
    end[row] = int(std::unique(begin, columns.begin() + first[row + 1]) - columns.begin());
  });
  SparseMatrix pattern(n_vertices, n_vertices);
  int n_entries = 0;
  for (Eigen::Index row = 0; row < n_vertices; ++row) {
    std::copy(columns.begin() + first[row], columns.begin() + end[row],
              columns.begin() + n_entries);
    n_entries += end[row] - first[row];
    pattern.outerIndexPtr()[row + 1] = n_entries;
  }
  pattern.resizeNonZeros(n_entries);
  std::copy_n(columns.begin(), n_entries, pattern.innerIndexPtr());
  std::fill_n(pattern.valuePtr(), n_entries, 0.0);
  return pattern;
}

}  // namespace

template <int Dim>
Topology<Dim>::Topology(Elements<Dim> T, Eigen::Index n_vertices)
    : T_(std::move(T)), n_vertices_(n_vertices) {
  if (T_.rows() == 0) throw InvalidMesh("geometry: no elements");
  if (T_.minCoeff() < 0 || T_.maxCoeff() >= n_vertices)
    throw InvalidMesh(
        fmt::format("geometry: an element names a vertex outside 0..{}", n_vertices - 1));
}

/// Isolated: a thread that waits in there must not take up work that asks for the same pattern.
template <int Dim>
const SparseMatrix& Topology<Dim>::pattern() const {
  std::call_once(is_made_, [this] { tbb::this_task_arena::isolate([this] { make_pattern(); }); });
  return pattern_;
}

template <int Dim>
void Topology<Dim>::make_pattern() const {
  pattern_ = pattern_of<Dim>(T_, n_vertices_);
  slots_.resize(std::size_t(T_.rows()) * Dim * Dim);
  const int* columns = pattern_.innerIndexPtr();
  tbb::parallel_for(Eigen::Index(0), T_.rows(), [&](Eigen::Index t) {
    int* slot = slots_.data() + t * Dim * Dim;
    for (int i = 0; i < Dim; ++i) {
      const int* begin = columns + pattern_.outerIndexPtr()[T_(t, i)];
      const int* end = columns + pattern_.outerIndexPtr()[T_(t, i) + 1];
      for (int j = 0; j < Dim; ++j)
        *slot++ = static_cast<int>(std::lower_bound(begin, end, T_(t, j)) - columns);
    }
  });
}

template <int Dim>
Geometry<Dim>::Geometry(Points<Dim> X, Elements<Dim> T)
    : Geometry(X, std::make_shared<const Topology<Dim>>(std::move(T), X.rows()), nullptr) {}

template <int Dim>
Geometry<Dim>::Geometry(Points<Dim> X, Elements<Dim> T, const Border<Dim>& border)
    : Geometry(std::move(X), std::move(T)) {
  const auto on = on_border(border);
  if (std::all_of(on->places.begin(), on->places.end(),
                  [](Place place) { return place == Place::kFree; }))
    return;
  border_ = on;
  set_border();
}

template <int Dim>
Geometry<Dim>::Geometry(Points<Dim> X, Elements<Dim> T, const Border<Dim>& border,
                        const WholeShape& whole)
    : Geometry(std::move(X), std::move(T)) {
  assert(Eigen::Index(whole.is_held.size()) == n_vertices());
  std::shared_ptr<OnBorder> on = on_border(border);
  on->is_fixed = whole.is_held;
  on->whole_radius = whole.radius_mm;
  border_ = std::move(on);
  set_border();
}

template <int Dim>
Geometry<Dim> Geometry<Dim>::moved_to(Points<Dim> X) const {
  return Geometry(std::move(X), topology_, border_);
}

template <int Dim>
Geometry<Dim>::Geometry(Points<Dim> X, std::shared_ptr<const Topology<Dim>> topology,
                        std::shared_ptr<const OnBorder> border)
    : X_(std::move(X)), topology_(std::move(topology)), border_(std::move(border)) {
  const Elements<Dim>& T = elements();
  const Eigen::Index m = T.rows();
  measures_.resize(m);
  normals_.resize(m, Dim);
  gradients_.resize(m);
  lumped_mass_.setZero(X_.rows());
  nodal_normals_.setZero(X_.rows(), Dim);
  tbb::parallel_for(Eigen::Index(0), m, [&](Eigen::Index t) {
    normals_.row(t) = area_vector(X_, T.row(t));
    measures_[t] = normals_.row(t).norm();
    gradients_[t] = p1_gradients<Dim, Dim>(corners<Dim>(X_, T.row(t)));
  });
  for (Eigen::Index t = 0; t < m; ++t) {
    if (!(measures_[t] > 0))
      throw InvalidMesh(fmt::format("geometry: element {} has no measure", t));
    for (int i = 0; i < Dim; ++i) {
      lumped_mass_[T(t, i)] += measures_[t] / Dim;
      nodal_normals_.row(T(t, i)) += normals_.row(t) / Dim;
    }
    normals_.row(t) /= measures_[t];
  }
  for (Eigen::Index i = 0; i < X_.rows(); ++i)
    if (lumped_mass_[i] > 0) nodal_normals_.row(i) /= lumped_mass_[i];
  set_border();
}

template <int Dim>
std::shared_ptr<typename Geometry<Dim>::OnBorder> Geometry<Dim>::on_border(
    const Border<Dim>& border) const {
  assert(Eigen::Index(border.planes.size()) == n_vertices() && border.normals.rows() <= 8);
  const Elements<Dim>& T = elements();
  auto out = std::make_shared<OnBorder>();
  out->normals = border.normals;
  out->places.assign(T.rows(), Place::kFree);
  out->held.assign(n_vertices(), 0);
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    std::uint8_t common = 0xff;
    for (int i = 0; i < Dim; ++i) common &= border.planes[T(t, i)];
    if (common == 0) continue;
    out->places[t] = Place::kBorder;
    for (int i = 0; i < Dim; ++i) out->held[T(t, i)] |= common;
  }
  out->rim_measures = Eigen::VectorXd::Zero(T.rows());
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const auto is_held = [&](int vertex) { return out->held[vertex] != 0; };
    if (out->places[t] == Place::kBorder || T.row(t).unaryExpr(is_held).count() == 0) continue;
    out->places[t] = Place::kRim;
    out->rim_measures[t] = measures_[t];
  }
  return out;
}

template <int Dim>
bool Geometry<Dim>::has_border_of(const Geometry& other) const {
  if (border_ == other.border_) return true;
  return border_ && other.border_ && border_->held == other.border_->held &&
         border_->places == other.border_->places && border_->is_fixed == other.border_->is_fixed;
}

/// What follows from border_ at the present positions.
template <int Dim>
void Geometry<Dim>::set_border() {
  if (!border_) return;
  const Elements<Dim>& T = elements();
  charged_measures_ = measures_;
  directions_ = nodal_normals_;
  Points<Dim> normals = Points<Dim>::Zero(n_vertices(), Dim);  // of what does not lie on the border
  Eigen::VectorXd masses = Eigen::VectorXd::Zero(n_vertices());
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    if (place(t) != Place::kFree) charged_measures_[t] = border_->rim_measures[t];
    if (place(t) == Place::kBorder) continue;
    for (int i = 0; i < Dim; ++i) {
      normals.row(T(t, i)) += measures_[t] * normals_.row(t);
      masses[T(t, i)] += measures_[t];
    }
  }
  for (Eigen::Index i = 0; i < n_vertices(); ++i) {
    if (!is_on_border(i)) continue;
    if (is_fixed(i)) {
      directions_.row(i).setZero();
      continue;
    }
    Vector<Dim> in_planes = Vector<Dim>::Zero();
    if (masses[i] > 0) in_planes = normals.row(i) / masses[i];
    directions_.row(i) = along_border<Dim>(in_planes, border_->normals, border_->held[i]);
  }
}

template <int Dim>
Eigen::VectorXd Geometry<Dim>::content_derivative() const {
  return lumped_mass_.cwiseProduct(nodal_normals_.cwiseProduct(directions()).rowwise().sum());
}

template <int Dim>
double Geometry<Dim>::enclosed() const {
  assert(!is_part());
  double sum = 0;
  for (Eigen::Index t = 0; t < n_elements(); ++t)
    sum += measures_[t] * (X_.row(elements()(t, 0)) - X_.row(0)).dot(normals_.row(t));
  return sum / Dim;
}

template <int Dim>
double Geometry<Dim>::radius() const {
  if (is_part()) return border_->whole_radius;
  const double content = std::max(enclosed(), 0.0);
  if constexpr (Dim == 2)
    return std::sqrt(content / std::numbers::pi);
  else
    return std::cbrt(content * 3 / (4 * std::numbers::pi));
}

template <int Dim>
Points<Dim> quadrature_points(
    const Points<Dim>& X, const Elements<Dim>& T,
    const Eigen::Matrix<double, Eigen::Dynamic, Dim, Eigen::RowMajor>& barycentric) {
  const Eigen::Index q = barycentric.rows();
  Points<Dim> out(T.rows() * q, Dim);
  Eigen::Matrix<double, Dim, Dim> corners;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    for (int i = 0; i < Dim; ++i) corners.row(i) = X.row(T(t, i));
    out.middleRows(t * q, q).noalias() = barycentric * corners;
  }
  return out;
}

template class Topology<2>;
template class Topology<3>;
template class Geometry<2>;
template class Geometry<3>;
template Points<2> quadrature_points<2>(const Points<2>&, const Elements<2>&,
                                        const Eigen::Matrix<double, -1, 2, Eigen::RowMajor>&);
template Points<3> quadrature_points<3>(const Points<3>&, const Elements<3>&,
                                        const Eigen::Matrix<double, -1, 3, Eigen::RowMajor>&);

}  // namespace surf::fem
