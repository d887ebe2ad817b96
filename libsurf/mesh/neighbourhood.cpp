#include "libsurf/mesh/neighbourhood.h"

namespace surf::mesh {
namespace {

constexpr int kNext = 3;  // along each axis: the cube itself and one on either side

template <int Dim>
constexpr int kNear = Dim == 2 ? kNext* kNext : kNext* kNext* kNext;

}  // namespace

template <int Dim>
void Neighbourhood<Dim>::add(const Vector<Dim>& point) {
  const Index here = index(point);
  if (!occupied_.insert(key(here)).second) return;
  for (int n = 0; n < kNear<Dim>; ++n) {
    Index next = here;
    for (int axis = 0, rest = n; axis < Dim; ++axis, rest /= kNext) next[axis] += rest % kNext - 1;
    cubes_.insert(key(next));
  }
}

template <int Dim>
typename Neighbourhood<Dim>::Index Neighbourhood<Dim>::index(const Vector<Dim>& point) const {
  return (point / size_mm_).array().floor().template cast<std::int64_t>();
}

/// 21 bits of each: cubes that are two millions apart are taken for one.
template <int Dim>
std::uint64_t Neighbourhood<Dim>::key(const Index& index) {
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  std::uint64_t out = 0;
  for (const std::int64_t at : index) out = out << 21 | (std::uint64_t(at) & kMask);
  return out;
}

template class Neighbourhood<2>;
template class Neighbourhood<3>;

}  // namespace surf::mesh
