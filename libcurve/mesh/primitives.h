// Initial curves: circles, ellipses, polygons and what is put together from them.
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// Circle, counter-clockwise: a regular polygon of at least 8 elements with its nodes on the circle
/// and elements no longer than edge_length.
/// @throws UsageError  radius or edge_length is not positive, or more than 20 million elements
Segments circle(const Vector<2>& centre, double radius, double edge_length);

/// Ellipse { centre + axes * u : |u| = 1 }, counter-clockwise; elements no longer than edge_length.
/// @param axes  columns are the semi-axes [mm]; any invertible matrix
/// @throws UsageError  axes is singular; as for circle()
Segments ellipse(const Vector<2>& centre, const Eigen::Matrix2d& axes, double edge_length);

/// The closed polygon with these corners in this order, its sides cut into equal elements no longer
/// than edge_length.
/// @throws UsageError  fewer than three corners; as for circle()
Segments polygon(const Points<2>& corners, double edge_length);

/// Equal circles about the points lower + (i + 1/2, j + 1/2) * spacing that lie in the box.
/// @throws UsageError  spacing is not positive; as for circle()
Segments grid_of_circles(const Vector<2>& lower, const Vector<2>& upper, double spacing,
                         double radius, double edge_length);

/// Curves as one set: points and elements one after the other.
Segments joined(const std::vector<Segments>& parts);

/// The same curves run through the other way: the domain becomes the outside.
Segments flipped(Segments curves);

}  // namespace surf::curve
