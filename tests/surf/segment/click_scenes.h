// Images with clicks on a search grid, in the plane and in space.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "libsurf/segment/click_search.h"
#include "libsurf/segment/detail/click_cut.h"
#include "tests/surf/fixtures.h"
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
  segment::NodeSet<Dim> nodes(const std::function<bool(const Vector<Dim>&)>& is_inside) const {
    return segment::NodeSet<Dim>::where(grid.box(), [&](std::size_t at) {
      Vector<Dim> index;
      const auto node = grid.box().node(at);
      for (int axis = 0; axis < Dim; ++axis) index[axis] = node[axis];
      return is_inside(grid.node_to_world() * index);
    });
  }
  /// Of the nodes of `part`, how much is in `a`.
  static double covered(const segment::NodeSet<Dim>& part, const segment::NodeSet<Dim>& a) {
    return double(a.count_in_both(part)) / double(part.count());
  }
  static double dice(const segment::NodeSet<Dim>& a, const segment::NodeSet<Dim>& b) {
    return 2 * double(a.count_in_both(b)) / double(a.count() + b.count());
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

/// Tests with clicks on a dumbbell, in T::value dimensions.
template <class T>
struct DumbbellTest : ::testing::Test {
  static constexpr int kDim = T::value;
  using Clicks = std::vector<segment::Click<kDim>>;
  const ClickImage<kDim> image{is_in_dumbbell<kDim>};
  const segment::NodeSet<kDim> both = image.nodes(is_in_dumbbell<kDim>);

  static segment::Click<kDim> inside(double x, double y = 24) { return test::inside<kDim>(x, y); }
  static segment::Click<kDim> outside(double x, double y = 24) { return test::outside<kDim>(x, y); }
  static double dice(const segment::NodeSet<kDim>& a, const segment::NodeSet<kDim>& b) {
    return ClickImage<kDim>::dice(a, b);
  }
  /// The ball about x, whatever joins it to the other.
  segment::NodeSet<kDim> ball(double x) const {
    return image.nodes(
        [x](const Vector<kDim>& at) { return is_in_ball<kDim>(at, point<kDim>(x), 9); });
  }
  segment::ClickScene<kDim> scene(const segment::NodeSet<kDim>& before,
                                  const Clicks& clicks) const {
    segment::ClickScene<kDim> out{image.grid, before, {}, 0.03};
    for (const segment::Click<kDim>& click : clicks) out.clicks.push_back(image.on_grid(click));
    return out;
  }
};

}  // namespace surf::test
