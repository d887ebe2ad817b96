#include "libsurf/energy/domain_integrals.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <unordered_map>
#include <utility>
#include <vector>

#include "libsurf/base/disjoint_sets.h"
#include "libsurf/fem/quadrature.h"

namespace surf::energy {
namespace {

constexpr int kMaxRaySamples = 4096;

/// measure * nu of every element of X_s, each at its q quadrature points: (m * q, Dim) rows
/// weight * area vector.
template <int Dim>
Points<Dim> weighted_normals(const fem::Geometry<Dim>& shape, const Eigen::VectorXd& weights) {
  const Eigen::Index q = weights.size();
  Points<Dim> out(shape.n_elements() * q, Dim);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    out.middleRows(t * q, q).noalias() = weights * (shape.measures()[t] * shape.normals().row(t));
  return out;
}

/// Elements that one shape has and the other has not, connected by corners at the same place.
template <int Dim>
struct ChangedPart {
  std::vector<int> gone, added;
};

using Bits = std::uint64_t;

Bits mixed(Bits x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;  // the finaliser of splitmix64
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Of places: equal where they are, and else but by chance.
template <int Dim>
std::vector<Bits> keys_of_points(const Points<Dim>& X) {
  std::vector<Bits> out;
  for (const auto& x : X.rowwise()) {
    Bits key = 0;
    for (const double coordinate : x) key = mixed(key + std::bit_cast<Bits>(coordinate + 0.0));
    out.push_back(key);
  }
  return out;
}

/// Of elements as they are turned, whichever corner of a triangle comes first; with their numbers,
/// sorted.
template <int Dim>
std::vector<std::pair<Bits, int>> keys_of_elements(const Elements<Dim>& T,
                                                   const std::vector<Bits>& of_points) {
  std::vector<std::pair<Bits, int>> out;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    Bits key = 0;
    for (int i = 0; i < (Dim == 2 ? 1 : Dim); ++i)
      key += mixed(of_points[std::size_t(T(t, i))] ^
                   mixed(of_points[std::size_t(T(t, (i + 1) % Dim))] + 1));
    out.emplace_back(key, int(t));
  }
  std::sort(out.begin(), out.end());
  return out;
}

template <int Dim>
std::vector<ChangedPart<Dim>> changed_parts(const fem::Geometry<Dim>& from,
                                            const fem::Geometry<Dim>& to) {
  const std::array points = {keys_of_points<Dim>(from.points()), keys_of_points<Dim>(to.points())};
  const auto before = keys_of_elements<Dim>(from.elements(), points[0]),
             after = keys_of_elements<Dim>(to.elements(), points[1]);
  const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::array<std::vector<std::pair<Bits, int>>, 2> changed;
  std::set_difference(before.begin(), before.end(), after.begin(), after.end(),
                      std::back_inserter(changed[0]), less);
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                      std::back_inserter(changed[1]), less);
  std::unordered_map<Bits, int> number;  // of places
  for (int which = 0; which < 2; ++which)
    for (const auto& [unused, t] : changed[which])
      for (const int i : (which == 0 ? from : to).elements().row(t))
        number.emplace(points[which][std::size_t(i)], int(number.size()));
  DisjointSets sets(number.size());
  const auto place = [&](int which, int t, int i) {
    return number.at(points[which][std::size_t((which == 0 ? from : to).elements()(t, i))]);
  };
  for (int which = 0; which < 2; ++which)
    for (const auto& [unused, t] : changed[which])
      for (int i = 1; i < Dim; ++i) sets.join(place(which, t, 0), place(which, t, i));
  std::vector<ChangedPart<Dim>> out;
  std::unordered_map<int, std::size_t> part_of;
  for (int which = 0; which < 2; ++which) {
    auto& elements = changed[which];
    std::sort(elements.begin(), elements.end(),
              [](const auto& a, const auto& b) { return a.second < b.second; });
    for (const auto& [unused, t] : elements) {
      const auto [entry, is_new] = part_of.emplace(sets.find(place(which, t, 0)), out.size());
      if (is_new) out.emplace_back();
      ChangedPart<Dim>& part = out[entry->second];
      (which == 0 ? part.gone : part.added).push_back(t);
    }
  }
  return out;
}

}  // namespace

template <int Dim>
DomainIntegrals<Dim>::DomainIntegrals(int quadrature_order, double ray_spacing_mm, int n_integrands)
    : quadrature_order_(quadrature_order),
      ray_spacing_mm_(ray_spacing_mm),
      n_integrands_(n_integrands) {}

template <int Dim>
Eigen::VectorXd DomainIntegrals<Dim>::absolute(const Field<Dim>& field,
                                               const Integrands& integrands,
                                               const fem::Geometry<Dim>& shape) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  return along_rays(field, integrands, shape.points().colwise().mean(),
                    fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
                    weighted_normals<Dim>(shape, rule.weights));
}

template <int Dim>
Eigen::VectorXd DomainIntegrals<Dim>::along_rays(const Field<Dim>& field,
                                                 const Integrands& integrands,
                                                 const Vector<Dim>& from, Points<Dim> rays,
                                                 const Points<Dim>& normals) const {
  const Eigen::Matrix<double, 1, Dim> centre = from.transpose();
  rays.rowwise() -= centre;
  const Eigen::VectorXd flux = rays.cwiseProduct(normals).rowwise().sum();
  const double longest = rays.rowwise().norm().maxCoeff();
  const int n_samples =
      std::clamp(static_cast<int>(std::ceil(longest / ray_spacing_mm_)), 8, kMaxRaySamples);

  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n_integrands_);
  Samples<Dim> samples;
  Eigen::MatrixXd values(rays.rows(), n_integrands_);
  const auto& gauss = fem::quadrature<2>(3);  // two points on each interval of s
  for (int interval = 0; interval < n_samples; ++interval)
    for (Eigen::Index p = 0; p < gauss.size(); ++p) {
      const double s = (interval + gauss.points(p, 1)) / n_samples;
      const Points<Dim> x = (s * rays).rowwise() + centre;
      field.sample(x, Derivatives::kNone, samples);
      integrands(samples.value, values);
      sum += gauss.weights[p] / n_samples * std::pow(s, Dim - 1) * (values.transpose() * flux);
    }
  return sum;
}

template <int Dim>
std::optional<Eigen::VectorXd> DomainIntegrals<Dim>::between(const Field<Dim>& field,
                                                             const Integrands& integrands,
                                                             const fem::Geometry<Dim>& from,
                                                             const fem::Geometry<Dim>& to) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  const std::vector<ChangedPart<Dim>> parts = changed_parts<Dim>(from, to);
  std::size_t n_changed = 0;
  for (const ChangedPart<Dim>& part : parts) n_changed += part.gone.size() + part.added.size();
  if (double(n_changed) > kMostChanged * double(from.n_elements() + to.n_elements()))
    return std::nullopt;
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(n_integrands_, Eigen::Index(parts.size()));
  tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t n) {
    const ChangedPart<Dim>& part = parts[n];
    const auto n_all = Eigen::Index(part.gone.size() + part.added.size());
    Points<Dim> X(Dim * n_all, Dim), rays(n_all * rule.size(), Dim), normals(rays.rows(), Dim);
    Eigen::Index element = 0;
    const auto add = [&](const fem::Geometry<Dim>& shape, int t, double sign) {
      const Points<Dim> corners = shape.points()(shape.elements().row(t), Eigen::all);
      X.middleRows(Dim * element, Dim) = corners;
      rays.middleRows(element * rule.size(), rule.size()) = rule.points * corners;
      normals.middleRows(element * rule.size(), rule.size()) =
          rule.weights * (sign * shape.measures()[t] * shape.normals().row(t));
      ++element;
    };
    for (const int t : part.gone) add(from, t, -1);
    for (const int t : part.added) add(to, t, 1);
    sums.col(Eigen::Index(n)) =
        along_rays(field, integrands, X.colwise().mean(), std::move(rays), normals);
  });
  return sums.rowwise().sum();
}

template <int Dim>
Eigen::VectorXd DomainIntegrals<Dim>::swept(const Field<Dim>& field, const Integrands& integrands,
                                            const fem::Geometry<Dim>& from,
                                            const fem::Geometry<Dim>& to) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  const Points<Dim> displacement = to.points() - from.points();
  const Points<Dim> d = fem::quadrature_points<Dim>(displacement, from.elements(), rule.points);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n_integrands_);
  Samples<Dim> samples;
  Eigen::MatrixXd values(d.rows(), n_integrands_);
  const auto& gauss = fem::quadrature<2>(3);
  for (Eigen::Index p = 0; p < gauss.size(); ++p) {
    const auto shape = from.moved_to(from.points() + gauss.points(p, 1) * displacement);
    field.sample(fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
                 Derivatives::kNone, samples);
    integrands(samples.value, values);
    const Eigen::VectorXd flux =
        d.cwiseProduct(weighted_normals<Dim>(shape, rule.weights)).rowwise().sum();
    sum += gauss.weights[p] * (values.transpose() * flux);
  }
  return sum;
}

template class DomainIntegrals<2>;
template class DomainIntegrals<3>;

}  // namespace surf::energy
