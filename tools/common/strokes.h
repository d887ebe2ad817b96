// --marks: strokes that were painted into label maps.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/segment/click.h"

namespace surfseg {

/// A label map and where it lies.
template <int Dim>
struct Marks {
  surf::ImageBox<Dim> box;
  std::vector<float> labels;
};

/// The strokes of each label map.
/// @param box         of the image
/// @param has_inside  there is something inside already, and no map has to say more
/// @param read        a label map's file
/// @throws surf::InputError  as surf::segment::strokes(), with the file; no stroke is inside
template <int Dim>
std::vector<std::vector<surf::segment::Click<Dim>>> strokes_of(
    const std::vector<std::string>& paths, const surf::ImageBox<Dim>& box, bool has_inside,
    const std::function<Marks<Dim>(const std::string& path)>& read);

}  // namespace surfseg
