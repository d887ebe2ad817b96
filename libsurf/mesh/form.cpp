#include "libsurf/mesh/form.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/base/products.h"
#include "libsurf/mesh/measure.h"

namespace surf::mesh {
namespace {

/// Covariance of the points inside. Of a tetrahedron with the corners 0, a, b, c
/// int x x^T = det(a, b, c) / 120 (a a^T + b b^T + c c^T + s s^T), s = a + b + c.
Eigen::Matrix3d covariance_mm2(const Triangles& surface) {
  const Vector<3> center = centroid(surface);
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double volume = 0;
  for (const auto element : surface.elements.rowwise()) {
    const Vector<3> a = surface.points.row(element[0]).transpose() - center,
                    b = surface.points.row(element[1]).transpose() - center,
                    c = surface.points.row(element[2]).transpose() - center, sum = a + b + c;
    const double sixfold = triple(a, b, c);
    volume += sixfold / 6;
    moments += sixfold / 120 *
               (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  return moments / volume;
}

}  // namespace

double sphericity(const Triangles& surface) {
  const double area = area_mm2(surface), volume = std::abs(volume_mm3(surface));
  return area > 0 ? std::cbrt(36 * std::numbers::pi * volume * volume) / area : 0;
}

PrincipalAxes principal_axes(const Triangles& surface) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance_mm2(surface));
  if (solver.info() != Eigen::Success || !(solver.eigenvalues()[0] > 0))
    throw InvalidMesh("principal axes: the surface encloses no volume");
  PrincipalAxes out;
  for (int k = 0; k < 3; ++k) {  // Eigen's are in growing order
    out.semi_axes_mm[k] = std::sqrt(5 * solver.eigenvalues()[2 - k]);
    Vector<3> direction = solver.eigenvectors().col(2 - k);
    Eigen::Index largest;
    direction.cwiseAbs().maxCoeff(&largest);
    out.directions.col(k) = direction[largest] < 0 ? Vector<3>(-direction) : direction;
  }
  if (out.directions.determinant() < 0) out.directions.col(2) *= -1;
  return out;
}

Form form(const Triangles& surface) {
  return {sphericity(surface), principal_axes(surface), feret_diameters(surface)};
}

}  // namespace surf::mesh
