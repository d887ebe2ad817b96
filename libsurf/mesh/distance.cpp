#include "libsurf/mesh/distance.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"

namespace surf::mesh {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangle = Kernel::Triangle_3;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Triangle>::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(const Vector<3>& point) { return {point[0], point[1], point[2]}; }

std::vector<Triangle> triangles_with_area(const Triangles& surface) {
  std::vector<Triangle> result;
  result.reserve(surface.elements.rows());
  for (const auto element : surface.elements.rowwise()) {
    const Vector<3> a = surface.points.row(element[0]), b = surface.points.row(element[1]),
                    c = surface.points.row(element[2]);
    if ((b - a).cross(c - a).squaredNorm() > 0)
      result.emplace_back(to_cgal(a), to_cgal(b), to_cgal(c));
  }
  return result;
}

/// Point k of the sequence (k / g, k / g^2) mod 1 with g^3 = g + 1, folded into the triangle
/// of barycentric coordinates.
Vector<3> barycentric(int k) {
  constexpr double kStep1 = 0.7548776662466927, kStep2 = 0.5698402909980532;
  double u = std::fmod(0.5 + k * kStep1, 1.0), v = std::fmod(0.5 + k * kStep2, 1.0);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return {1 - u - v, u, v};
}

/// Samples evenly spread over the area, see DistanceOptions.
Points<3> samples(const Triangles& surface, int n) {
  const Eigen::Index n_triangles = surface.elements.rows();
  std::vector<double> area_up_to(n_triangles);
  double total = 0;
  for (Eigen::Index row = 0; row < n_triangles; ++row) {
    const auto element = surface.elements.row(row);
    const Vector<3> a = surface.points.row(element[0]), b = surface.points.row(element[1]),
                    c = surface.points.row(element[2]);
    area_up_to[row] = total += (b - a).cross(c - a).norm();
  }
  if (!(total > 0)) throw InvalidMesh("surface distance: the surface has no area");
  Points<3> result(n, 3);
  Eigen::Index row = 0;
  for (int k = 0; k < n; ++k) {
    while (row + 1 < n_triangles && area_up_to[row] <= (k + 0.5) / n * total) ++row;
    const Vector<3> weights = barycentric(k);
    const auto element = surface.elements.row(row);
    result.row(k) = weights[0] * surface.points.row(element[0]) +
                    weights[1] * surface.points.row(element[1]) +
                    weights[2] * surface.points.row(element[2]);
  }
  return result;
}

/// The vertices that triangles use.
Points<3> used_vertices(const Triangles& surface) {
  std::vector<int> used(surface.elements.data(), surface.elements.data() + surface.elements.size());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return surface.points(used, Eigen::all);
}

std::vector<double> values_at(const Points<3>& points,
                              const std::function<double(const Vector<3>&)>& function) {
  std::vector<double> values(points.rows());
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, points.rows(), 256),
                    [&](const auto& range) {
                      for (Eigen::Index i = range.begin(); i < range.end(); ++i)
                        values[i] = function(points.row(i).transpose());
                    });
  return values;
}

}  // namespace

struct DistanceToSurface::Impl {
  std::vector<Triangle> triangles;
  Tree tree;
};

DistanceToSurface::DistanceToSurface(const Triangles& surface) : impl_(std::make_unique<Impl>()) {
  impl_->triangles = triangles_with_area(surface);
  if (impl_->triangles.empty())
    throw InvalidMesh("surface distance: the surface has no triangle with an area");
  impl_->tree.insert(impl_->triangles.cbegin(), impl_->triangles.cend());
  impl_->tree.build();
  impl_->tree.accelerate_distance_queries();  // built here, so that queries only read
}
DistanceToSurface::~DistanceToSurface() = default;
DistanceToSurface::DistanceToSurface(DistanceToSurface&&) noexcept = default;

double DistanceToSurface::operator()(const Vector<3>& point) const {
  return std::sqrt(impl_->tree.squared_distance(to_cgal(point)));
}

DistanceStatistics distances_from(const Triangles& surface,
                                  const std::function<double(const Vector<3>&)>& distance,
                                  const DistanceOptions& options) {
  return distance_statistics(values_at(samples(surface, options.n_samples), distance),
                             values_at(used_vertices(surface), distance));
}

SurfaceDistances surface_distances(const Triangles& first, const Triangles& second,
                                   const DistanceOptions& options) {
  const DistanceToSurface to_first(first), to_second(second);
  const auto function = [](const DistanceToSurface& distance) {
    return [&distance](const Vector<3>& point) { return distance(point); };
  };
  return symmetric_distances(distances_from(first, function(to_second), options), area_mm2(first),
                             distances_from(second, function(to_first), options), area_mm2(second));
}

}  // namespace surf::mesh
