// CGAL's surface mesher on the isosurface of the trilinear interpolation, which is told the value:
//
//   cgal_mesher VOLUME.nii VALUE X,Y,Z SURFACE.off
//
// It looks for the surface from the point. Angles of at least 30 degrees, triangles of at most 2
// voxels, a tenth of a voxel off.
#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/IO/Complex_2_in_triangulation_3_file_writer.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "raw_volume.h"

namespace {

using Triangulation = CGAL::Surface_mesh_default_triangulation_3;
using Complex = CGAL::Complex_2_in_triangulation_3<Triangulation>;
using Point = Triangulation::Geom_traits::Point_3;
using Sphere = Triangulation::Geom_traits::Sphere_3;

struct Interpolation {
  const RawVolume* volume;
  double value;

  /// Negative inside, where the intensities are above the value.
  double operator()(const Point& p) const {
    std::array<int, 3> first;
    std::array<double, 3> t;
    const double x[] = {p.x(), p.y(), p.z()};
    for (int axis = 0; axis < 3; ++axis) {
      const double u = std::clamp((x[axis] - volume->origin) / volume->spacing, 0.0,
                                  double(volume->size[axis] - 1));
      first[axis] = std::min(int(u), volume->size[axis] - 2);
      t[axis] = u - first[axis];
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::size_t at = 0;
      for (int axis = 2; axis >= 0; --axis) {
        const int bit = corner >> axis & 1;
        weight *= bit ? t[axis] : 1 - t[axis];
        at = at * std::size_t(volume->size[axis]) + std::size_t(first[axis] + bit);
      }
      sum += weight * volume->values[at];
    }
    return value - sum;
  }
};

}  // namespace

int main(int argc, char** argv) {
  expect_arguments(argc, 4, "cgal_mesher VOLUME.nii VALUE X,Y,Z SURFACE.off");
  const RawVolume volume(argv[1]);
  const std::array<double, 3> seed = point_of(argv[3]);
  const PeerClock clock;
  using Surface = CGAL::Implicit_surface_3<Triangulation::Geom_traits, Interpolation>;
  const Surface surface(Interpolation{&volume, std::atof(argv[2])},
                        Sphere(Point(seed[0], seed[1], seed[2]), 4));
  Triangulation triangulation;
  Complex complex(triangulation);
  const CGAL::Surface_mesh_default_criteria_3<Triangulation> criteria(30, 2 * volume.spacing,
                                                                      0.1 * volume.spacing);
  CGAL::make_surface_mesh(complex, surface, criteria, CGAL::Manifold_tag());
  clock.stop();
  std::ofstream file(argv[4]);
  CGAL::output_surface_facets_to_off(file, complex);
  return file ? 0 : 4;
}
