// Points that a moving curve or surface may not come near: obstacles on either side of it.
#pragma once

#include <optional>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/base/types.h"

namespace surf::mesh {

/// A point that is known to belong to the domain, or not to.
template <int Dim>
struct HeldPoint {
  Vector<Dim> point = Vector<Dim>::Zero();  ///< [mm]
  bool is_inside = true;
};

/// One flag per point: it lies in the domain, where the winding number is at least one.
/// O(n log k) for n elements and k points, and a few ns for each pair with a common last
/// coordinate.
template <int Dim>
std::vector<char> are_inside(const Simplices<Dim>& shape, const Points<Dim>& points);

/// Where a shape is nearest to a point.
template <int Dim>
struct NearestPlace {
  Eigen::Index element = -1;
  Vector<Dim> place = Vector<Dim>::Zero();
  double distance_mm = 0;
};

/// A ball round each of some points, into which no element of a shape may come. Elements on the
/// border of the image do not count: there the shape ends because the image does.
///
/// Immutable. What looks at elements costs O(n log k) for n elements and k points if few are near.
template <int Dim>
class PointObstacles {
 public:
  /// @param distance_mm  radius of the balls, > 0 if there are points
  PointObstacles(std::vector<Vector<Dim>> points, double distance_mm,
                 const std::optional<ImageBox<Dim>>& box);
  PointObstacles() = default;

  bool empty() const { return points_.empty(); }
  const std::vector<Vector<Dim>>& points() const { return points_; }

  /// Whether a point lies within this margin of the element's box.
  bool is_near(const Eigen::Matrix<double, Dim, Dim>& corners, double margin_mm) const;

  /// A step in which elements slide round the balls: it is taken in parts of at most a third of the
  /// radius, after each of which the elements that reach into a ball are moved out of it, each
  /// along the direction from the point to its nearest place with the least squared moves of its
  /// vertices, in turn until none does; vertices of those that still do stay where they were before
  /// the part. `to` stays as it is, to the bit, where nothing comes near.
  /// @pre  no element of `from` reaches into a ball
  void limit(const Points<Dim>& from, const Elements<Dim>& T, Points<Dim>& to) const;

  /// After vertices of a step were set back to `from`: those of elements that now reach into a ball
  /// or went through its inner third are set back, too.
  /// @param limited  what limit() made of the step
  /// @return  number of vertices set back
  Eigen::Index hold(const Points<Dim>& from, const Points<Dim>& limited, const Elements<Dim>& T,
                    Points<Dim>& to) const;

  /// Moves elements out of the balls as limit() does.
  /// @return  whether a vertex was moved
  bool push_away(const Elements<Dim>& T, Points<Dim>& X) const;

  /// Numbers of the points into whose balls elements reach, ascending.
  std::vector<std::size_t> violated(const Elements<Dim>& T, const Points<Dim>& X) const;

 private:
  struct Pair {
    Eigen::Index element;
    int point;
  };
  class Sliding;

  template <class Visit>
  void for_each_in(const Vector<Dim>& low, const Vector<Dim>& high, const Visit& visit) const;
  template <class Visit>
  void for_each_in(const Vector<Dim>& low, const Vector<Dim>& high, std::size_t begin,
                   std::size_t end, int axis, const Visit& visit) const;
  void sort(std::size_t begin, std::size_t end, int axis);
  std::vector<Pair> pairs_near(const Points<Dim>& from, const Points<Dim>& to,
                               const Elements<Dim>& T, double margin_mm) const;
  bool is_lid(const Points<Dim>& X, const Elements<Dim>& T, Eigen::Index t) const;

  std::vector<Vector<Dim>> points_;
  std::vector<int> tree_;  ///< the points, each half-range split at its middle along the next axis
  double distance_mm_ = 0;
  std::optional<ImageBox<Dim>> box_;
};

/// One flag per held point: it lies on its side of the shape, no nearer to it than the distance
/// [mm].
template <int Dim>
std::vector<char> are_held(const Simplices<Dim>& shape, const std::vector<HeldPoint<Dim>>& held,
                           double distance_mm, const std::optional<ImageBox<Dim>>& box);

/// Where the shape comes nearest to a point; elements on the border of the image do not count.
template <int Dim>
NearestPlace<Dim> nearest_place(const Simplices<Dim>& shape, const Vector<Dim>& point,
                                const std::optional<ImageBox<Dim>>& box);

}  // namespace surf::mesh
