#include "libsurf/mesh/detail/ray_crossings.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace surf::mesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corners = std::array<Vector<3>, 3>;

/// The origins, ascending in z: a triangle asks for those between its lowest and highest corner.
class Rays {
 public:
  explicit Rays(const Points<3>& origins) : order_(origins.rows()) {
    std::iota(order_.begin(), order_.end(), 0);
    std::stable_sort(order_.begin(), order_.end(),
                     [&](int a, int b) { return origins(a, 2) < origins(b, 2); });
    for (const int ray : order_) z_.push_back(origins(ray, 2));
  }

  /// Calls visit(ray) for low <= z < high.
  template <class Visit>
  void for_each_between(double low, double high, Visit visit) const {
    auto at = std::lower_bound(z_.begin(), z_.end(), low) - z_.begin();
    for (; at < std::ptrdiff_t(z_.size()) && z_[at] < high; ++at) visit(order_[at]);
  }

 private:
  std::vector<int> order_;
  std::vector<double> z_;
};

Kernel::Point_2 projected(const Vector<3>& p) { return {p[1], p[2]}; }
Kernel::Point_3 to_cgal(const Vector<3>& p) { return {p[0], p[1], p[2]}; }

/// Whether the edge passes the origin's z at a larger y. @pre it runs from below to above
bool is_right(const Vector<3>& below, const Vector<3>& above, const Vector<3>& origin) {
  return CGAL::orientation(projected(below), projected(above), projected(origin)) ==
         CGAL::LEFT_TURN;
}

/// The line through the origin along x meets the triangle: one of the two edges that pass its z
/// lies to the right.
bool is_on_line(const Corners& at, const Vector<3>& origin) {
  int n_right = 0;
  for (int corner = 0; corner < 3; ++corner) {
    const Vector<3>&p = at[corner], &q = at[(corner + 1) % 3];
    const bool from_above = p[2] > origin[2], to_above = q[2] > origin[2];
    if (from_above != to_above)
      n_right += from_above ? is_right(q, p, origin) : is_right(p, q, origin);
  }
  return n_right == 1;
}

/// Sign of the crossing, 0 if there is none.
int crossing(const Corners& at, const Vector<3>& origin) {
  const auto beyond = [&](int axis) {  // some corner
    return at[0][axis] > origin[axis] || at[1][axis] > origin[axis] || at[2][axis] > origin[axis];
  };
  if (!beyond(0) || !beyond(1) || !is_on_line(at, origin)) return 0;
  // n . (origin - a) = n_x (x of the origin - x of the crossing), n the doubled area.
  const int n_x = CGAL::orientation(projected(at[0]), projected(at[1]), projected(at[2]));
  const int side =
      CGAL::orientation(to_cgal(at[0]), to_cgal(at[1]), to_cgal(at[2]), to_cgal(origin));
  return side == -n_x ? n_x : 0;
}

}  // namespace

std::vector<RayCrossing> ray_crossings(const Triangles& surface, const Points<3>& origins) {
  const Rays rays(origins);
  std::vector<RayCrossing> result;
  for (int row = 0; row < surface.elements.rows(); ++row) {
    const auto element = surface.elements.row(row);
    const auto z = [&](int corner) { return surface.points(element[corner], 2); };
    const auto [low, high] = std::minmax({z(0), z(1), z(2)});
    rays.for_each_between(low, high, [&](int ray) {
      const Corners at = {surface.points.row(element[0]), surface.points.row(element[1]),
                          surface.points.row(element[2])};
      if (const int sign = crossing(at, origins.row(ray)); sign != 0)
        result.push_back({ray, row, sign});
    });
  }
  std::sort(result.begin(), result.end(), [](const RayCrossing& a, const RayCrossing& b) {
    return std::tie(a.ray, a.element) < std::tie(b.ray, b.element);
  });
  return result;
}

std::vector<int> extreme_vertices(const Triangles& surface, const Components& parts) {
  std::vector<int> result(parts.n, -1);
  for (Eigen::Index row = 0; row < surface.elements.rows(); ++row)
    for (const int vertex : surface.elements.row(row)) {
      int& furthest = result[parts.of_element[row]];
      if (furthest < 0 || surface.points(vertex, 0) > surface.points(furthest, 0))
        furthest = vertex;
    }
  return result;
}

}  // namespace surf::mesh
