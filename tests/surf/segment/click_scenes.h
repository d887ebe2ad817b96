// Images with clicks on a search grid, in the plane and in space.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "libsurf/segment/click_search.h"
#include "tests/surf/segment/lattice_image.h"

namespace surf::test {

/// Distance of a point in space from the axes beyond the first, and along the first.
template <int Dim>
Vector<Dim> point(double x, double y = 24, double z = 24) {
  return Eigen::Vector3d(x, y, z).template head<Dim>();
}

template <int Dim>
bool is_in_ball(const Vector<Dim>& x, const Vector<Dim>& center, double radius) {
  return (x - center).norm() <= radius;
}

/// Two balls of radius 9 about 14 and 34 on the first axis that a bridge of radius 4 joins: by its
/// intensities one object.
template <int Dim>
bool is_in_dumbbell(const Vector<Dim>& x) {
  const Vector<Dim> off = x - point<Dim>(24);
  const double away = off.tail(Dim - 1).norm();
  return is_in_ball<Dim>(x, point<Dim>(14), 9) || is_in_ball<Dim>(x, point<Dim>(34), 9) ||
         (std::abs(off[0]) < 10 && away <= 4);
}

/// The image's search grid, and clicks on it.
template <int Dim>
struct ClickImage {
  LatticeImage<Dim> image;
  segment::SearchGrid<Dim> grid;

  explicit ClickImage(const std::function<bool(const Vector<Dim>&)>& is_inside, double noise = 0.03)
      : image(image_of<Dim>(is_inside, noise)),
        grid(image, image.extent(), {image.extent(), 1.5e6}) {}

  segment::GridClick<Dim> on_grid(const segment::Click<Dim>& click) const {
    const segment::SeedView<Dim> view(grid, std::array{click.point_mm});
    return {view.seeds.front(), click.side};
  }
  segment::Flags flags(const std::function<bool(const Vector<Dim>&)>& is_inside) const {
    segment::Flags out(grid.box().n());
    for (std::size_t at = 0; at < out.size(); ++at) {
      Vector<Dim> index;
      const auto node = grid.box().node(at);
      for (int axis = 0; axis < Dim; ++axis) index[axis] = node[axis];
      out[at] = is_inside(grid.node_to_world() * index);
    }
    return out;
  }
  /// Of the nodes of `part`, how much is in `a`.
  static double covered(const segment::Flags& part, const segment::Flags& a) {
    double both = 0, n = 0;
    for (std::size_t at = 0; at < a.size(); ++at) {
      both += a[at] && part[at];
      n += part[at];
    }
    return both / n;
  }
  static double dice(const segment::Flags& a, const segment::Flags& b) {
    double both = 0, sum = 0;
    for (std::size_t at = 0; at < a.size(); ++at) {
      both += a[at] && b[at];
      sum += a[at] + b[at];
    }
    return 2 * both / sum;
  }
};

template <int Dim>
segment::Click<Dim> inside(double x, double y = 24) {
  return {point<Dim>(x, y), segment::Side::kInside};
}
template <int Dim>
segment::Click<Dim> outside(double x, double y = 24) {
  return {point<Dim>(x, y), segment::Side::kOutside};
}

}  // namespace surf::test
