// One slice through a volume along the world's axes: its pixels, and what is drawn on them.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "libsurf/io/picture.h"
#include "libsurf/io/slices.h"
#include "libsurf/volume/volume.h"

namespace surf::io::detail {

constexpr Color kBackground = {0, 0, 0};

/// A slice: the world's axes across and up. World coordinates fall to the right, which puts R
/// and A on the left, and rise upwards.
struct View {
  int across, up, normal;     ///< axes, 0 to 2
  std::array<char, 4> sides;  ///< letters left, right, top, bottom
};
/// By SlicePlane.
extern const std::array<View, 3> kViews;

/// How marks are drawn: crosses up to this distance from the slice [mm], rings beyond if asked for.
struct MarkStyle {
  double cross_mm = 0;
  bool has_rings = true;
};

class SliceView {
 public:
  /// @param view, box  must outlive this
  SliceView(const View& view, const Eigen::AlignedBox3d& box, const Vector<3>& center,
            double mm_per_pixel);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Row by row; NaN outside the volume.
  std::vector<double> sample(const volume::Volume& volume) const;
  Picture draw(const std::vector<double>& values, const std::array<double, 2>& window) const;
  void draw_outline(Picture& picture, const Triangles& surface) const;
  void draw_marks(Picture& picture, const std::vector<Mark>& marks, const MarkStyle& style) const;
  /// Letters at the sides.
  void draw_sides(Picture& picture) const;
  /// Where the slice lies: S12.5.
  void draw_place(Picture& picture) const;

 private:
  int pixels(int axis) const;
  Vector<3> world(int x, int y) const;
  /// Picture coordinates of a world point; pixel (x, y) has its centre at (x, y).
  Eigen::Vector2d project(const Vector<3>& point) const;

  const View& view_;
  const Eigen::AlignedBox3d& box_;
  Vector<3> center_;
  double mm_per_pixel_;
  int width_, height_;
};

}  // namespace surf::io::detail
