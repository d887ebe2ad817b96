// Integrals over the domain enclosed by a shape, computed from its boundary.
#pragma once

#include <functional>
#include <optional>

#include "libsurf/base/field.h"
#include "libsurf/fem/geometry.h"

namespace surf::energy {

/// Maps field values (q) at q points to rows of integrands (q, k).
using Integrands = std::function<void(const Eigen::VectorXd& value, Eigen::MatrixXd& out)>;

/// Integrals over Omega of k functions of one field.
///
/// Absolute values by the divergence theorem with P(x) = (x - c) int_0^1 s^(Dim-1) F(c + s (x -
/// c)) ds, div P = F: samples along the rays from c (the centroid of the vertices) to the
/// boundary, for any closed shape, whether or not c lies inside. Changes from what the boundary
/// sweeps: int_0^1 int_{Gamma_s} F d . nu dS ds along X_s = X + s d, two Gauss points in s, exact
/// for constant F. Between two meshes of which most elements are the same, by the others alone:
/// those of one and those of the other, turned round, bound what has changed, and rays from the
/// middle of each such part are as short as it is.
template <int Dim>
class DomainIntegrals {
 public:
  /// @param quadrature_order  on the elements
  /// @param ray_spacing_mm    distance of the samples along a ray
  DomainIntegrals(int quadrature_order, double ray_spacing_mm, int n_integrands);

  Eigen::VectorXd absolute(const Field<Dim>& field, const Integrands& integrands,
                           const fem::Geometry<Dim>& shape) const;
  Eigen::VectorXd swept(const Field<Dim>& field, const Integrands& integrands,
                        const fem::Geometry<Dim>& from, const fem::Geometry<Dim>& to) const;
  /// Over `to` less over `from`; elements are the same if their corners are. O(elements), samples
  /// at those that are not. Nothing if these are more than kMostChanged of all: from scratch costs
  /// less.
  std::optional<Eigen::VectorXd> between(const Field<Dim>& field, const Integrands& integrands,
                                         const fem::Geometry<Dim>& from,
                                         const fem::Geometry<Dim>& to) const;

 private:
  static constexpr double kMostChanged = 0.25;

  /// Along rays from a point to elements, by their flux: each row weight * area vector.
  Eigen::VectorXd along_rays(const Field<Dim>& field, const Integrands& integrands,
                             const Vector<Dim>& from, Points<Dim> to,
                             const Points<Dim>& weighted_normals) const;

  int quadrature_order_;
  double ray_spacing_mm_;
  int n_integrands_;
};

}  // namespace surf::energy
