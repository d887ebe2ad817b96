#include "libsurf/fem/geometry.h"

int main() {
  surf::Points<2> points(3, 2);
  points << 0, 0, 1, 0, 0, 1;
  surf::Elements<2> segments(3, 2);
  segments << 0, 1, 1, 2, 2, 0;
  return surf::fem::Geometry<2>(points, segments).measure() > 3.4 ? 0 : 1;
}
