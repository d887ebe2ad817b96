// A surface against a reference, and its own quality, in numbers.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surfseg {

/// The reference as a surface, and as the label map it came from.
struct Reference {
  surf::Triangles surface;
  std::optional<surf::volume::Volume> labels;
};

/// Dice, Jaccard, volumes (null where one of the two encloses none), distances [mm] and quality:
/// docs/file-formats.md.
/// @param label  of the reference's labels; none = all that are not 0
/// @throws surf::InvalidMesh  a surface has no area
nlohmann::ordered_json surface_scores(const surf::Triangles& surface, const Reference& reference,
                                      const std::optional<int>& label);

}  // namespace surfseg
