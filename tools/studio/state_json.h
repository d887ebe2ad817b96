// What the page is told: the state as JSON, surfaces as bytes (docs/studio-protocol.md).
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "libsurf/base/types.h"
#include "libsurf/segment/certainty.h"
#include "tools/studio/dialogue.h"
#include "tools/studio/folder.h"

namespace surfseg::studio {

nlohmann::ordered_json to_json(const State& state, const std::filesystem::path& folder,
                               const std::string& version);
nlohmann::ordered_json to_json(const Job& job);

/// uint32 n_vertices, n_triangles, n_arrays, frame; float32 xyz; uint32 triangles; float32 arrays.
std::string surface_bytes(const surf::Triangles& surface, int frame,
                          const surf::segment::Certainty<3>* certainty);

}  // namespace surfseg::studio
