// What may be clicked, and what the clicks of one object mean to another; private to
// segment/*.cpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

/// @param clicks  of the same object
/// @throws UsageError  a point of the click is outside the image, or in the same cell as one of the
/// other side
template <int Dim>
void check_click(const ImageExtent<Dim>& extent, const std::vector<Click<Dim>>& clicks,
                 const Click<Dim>& click);

/// @param clicks  of an object of that name
/// @throws UsageError  both have an inside click in the same cell
template <int Dim>
void check_beside(const ImageExtent<Dim>& extent, const std::vector<Click<Dim>>& clicks,
                  const std::string& name, const Click<Dim>& click);

/// That the inside clicks are in the box.
/// @throws UsageError  one is not, or see cells_of_box
template <int Dim>
void check_box(const ImageExtent<Dim>& extent, const std::optional<BoxCorners<Dim>>& box_mm,
               const std::vector<Click<Dim>>& clicks);

/// That no blur is wider than the image, and in the plane no edge shorter than a fiftieth of a
/// pixel: rounding is then more than what the curve's factors say, and at a thousandth of a pixel
/// curves become twice as long.
/// @throws UsageError  one is
template <int Dim>
void check_lengths(const ImageExtent<Dim>& extent, const Options<Dim>& options);

template <int Dim>
std::vector<Vector<Dim>> points_on(Side side, const std::vector<Click<Dim>>& clicks);

/// The inside clicks, as outside clicks of other objects.
template <int Dim>
std::vector<Click<Dim>> as_outside(const std::vector<Click<Dim>>& clicks);

/// Whether all of a part are among the clicks.
template <int Dim>
bool contains_all(const std::vector<Click<Dim>>& clicks, const std::vector<Click<Dim>>& part);

/// What a search in the box looks at: beyond it there is nothing of the object anyway. Of a stroke
/// what lies in it.
template <int Dim>
std::vector<Click<Dim>> clicks_in_box(const ImageExtent<Dim>& extent,
                                      const std::optional<BoxCorners<Dim>>& box_mm,
                                      std::vector<Click<Dim>> clicks);

/// The clicks, as obstacles.
template <int Dim>
std::vector<mesh::HeldPoint<Dim>> held_points(const std::vector<Click<Dim>>& clicks);

/// How near a shape may come to a click [cells].
inline constexpr double kLeastDistance = 0.5;

/// Whether a shape has the clicks where they belong, no nearer to it than that.
template <int Dim>
bool obeys(const Simplices<Dim>& shape, const std::vector<Click<Dim>>& clicks,
           const ImageExtent<Dim>& extent);

/// Whether a shape has the clicks where they belong, however near.
template <int Dim>
bool heeds(const Simplices<Dim>& shape, const std::vector<Click<Dim>>& clicks);

}  // namespace surf::segment
