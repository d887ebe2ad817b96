// Where some points are, and what is near.
#pragma once

#include <cstdint>
#include <unordered_set>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// The cubes (squares) of a lattice that hold some points, and those next to them.
template <int Dim>
class Neighbourhood {
 public:
  /// @param size_mm  of the cubes, > 0
  explicit Neighbourhood(double size_mm) : size_mm_(size_mm) {}

  void add(const Vector<Dim>& point);
  bool contains(const Vector<Dim>& point) const { return cubes_.contains(key(index(point))); }

 private:
  using Index = Eigen::Array<std::int64_t, Dim, 1>;

  Index index(const Vector<Dim>& point) const;
  static std::uint64_t key(const Index& index);

  double size_mm_;
  std::unordered_set<std::uint64_t> occupied_, cubes_;
};

}  // namespace surf::mesh
