#include "tools/common/strokes.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/segment/marks.h"

namespace surfseg {

template <int Dim>
std::vector<std::vector<surf::segment::Click<Dim>>> strokes_of(
    const std::vector<std::string>& paths, const surf::ImageBox<Dim>& box, bool has_inside,
    const std::function<Marks<Dim>(const std::string& path)>& read) {
  std::vector<std::vector<surf::segment::Click<Dim>>> out;
  for (const std::string& path : paths) {
    const Marks<Dim> marks = read(path);
    try {
      surf::segment::check_same_grid<Dim>(box, marks.box);
      out.push_back(surf::segment::strokes<Dim>(marks.box, marks.labels));
    } catch (const surf::InputError& error) {
      throw surf::InputError(fmt::format("--marks: {}: {}", path, error.what()));
    }
    has_inside |= out.back().front().side == surf::segment::Side::kInside;
  }
  if (!has_inside)
    throw surf::InputError("--marks: no stroke is inside, label 1, and there is no --seed");
  return out;
}

#define SURFSEG_INSTANTIATE(Dim)                                                \
  template std::vector<std::vector<surf::segment::Click<Dim>>> strokes_of<Dim>( \
      const std::vector<std::string>&, const surf::ImageBox<Dim>&, bool,        \
      const std::function<Marks<Dim>(const std::string&)>&);
SURFSEG_INSTANTIATE(2)
SURFSEG_INSTANTIATE(3)
#undef SURFSEG_INSTANTIATE

}  // namespace surfseg
