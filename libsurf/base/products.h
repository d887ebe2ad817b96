// Products and angles of vectors in the plane and in space.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "libsurf/base/types.h"

namespace surf {

/// a x b in the plane: twice the signed area of the triangle (0, a, b), > 0 if b is left of a.
inline double cross(const Vector<2>& a, const Vector<2>& b) { return a[0] * b[1] - a[1] * b[0]; }

/// a . (b x c): six times the signed volume of the tetrahedron (0, a, b, c).
inline double triple(const Vector<3>& a, const Vector<3>& b, const Vector<3>& c) {
  return a.dot(b.cross(c));
}

/// Angle between two vectors, 0 to pi; exact near 0, where acos is not.
inline double angle_between(const Vector<2>& a, const Vector<2>& b) {
  return std::atan2(std::abs(cross(a, b)), a.dot(b));
}
inline double angle_between(const Vector<3>& a, const Vector<3>& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace surf
