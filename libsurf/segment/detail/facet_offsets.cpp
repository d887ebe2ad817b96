#include "libsurf/segment/detail/facet_offsets.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surf::segment {
namespace {

constexpr double kOffsetDoubt = 0.3;  // of a vertex' offset

}  // namespace

template <int Dim>
Eigen::VectorXd facet_offsets(const fem::Geometry<Dim>& geometry, const Points<Dim>& normals) {
  const Elements<Dim>& T = geometry.elements();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(geometry.n_vertices());
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    if (geometry.place(t) == fem::Place::kBorder) continue;
    Vector<Dim> middle = Vector<Dim>::Zero();
    for (int i = 0; i < Dim; ++i) middle += geometry.points().row(T(t, i)).transpose() / Dim;
    double height = 0;  // of the edge over the middle, by the normals
    for (int i = 0; i < Dim; ++i)
      height +=
          normals.row(T(t, i)).dot(geometry.points().row(T(t, i)) - middle.transpose()) / (2 * Dim);
    const double mean = height * (Dim == 3 ? 0.75 : 2.0 / 3);
    for (int i = 0; i < Dim; ++i)
      out[T(t, i)] += mean * geometry.measures()[t] / Dim / geometry.lumped_mass()[T(t, i)];
  }
  return out;
}

Eigen::VectorXd with_facet_offset(const Eigen::VectorXd& deviations,
                                  const Eigen::VectorXd& offsets) {
  Eigen::VectorXd out(deviations.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const double offset = std::abs(offsets[i]),
                 s = std::max(std::hypot(deviations[i], kOffsetDoubt * offset), 1e-300);
    double low = 0, high = offset + 3 * s;
    for (int step = 0; step < 40; ++step) {
      const double q = (low + high) / 2;
      const double inside = (std::erf((q - offset) / s / std::numbers::sqrt2) -
                             std::erf((-q - offset) / s / std::numbers::sqrt2)) /
                            2;
      (inside < 0.95 ? low : high) = q;
    }
    out[i] = high / 2;
  }
  return out;
}

template Eigen::VectorXd facet_offsets<2>(const fem::Geometry<2>&, const Points<2>&);
template Eigen::VectorXd facet_offsets<3>(const fem::Geometry<3>&, const Points<3>&);

}  // namespace surf::segment
