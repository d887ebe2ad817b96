#include "libcurve/mesh/primitives.h"
#include "libsurf/fem/geometry.h"

int main() {
  const surf::Segments circle = surf::curve::circle({1, 2}, 1, 0.01);
  const double length = surf::fem::Geometry<2>(circle.points, circle.elements).measure();
  return length > 6.28 && length < 6.2832 ? 0 : 1;
}
