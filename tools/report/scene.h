// The surfaces as the page's viewer has them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/common/segment_command.h"

namespace surfseg::report {

/// Of the surfaces together; with more they are thinned for the page, and further as far as it
/// needs to be small.
constexpr Eigen::Index kMostTriangles = 100'000, kFewestTriangles = 5'000;

struct Scene {
  nlohmann::ordered_json json;  ///< null if there is nothing to see
  std::string thinned;  ///< "2 surfaces of 400000 triangles are shown with 100000", "" if not
};

/// Points in steps of 1/65535 of the bounding box, arrays in base64 with the low byte first.
/// @param most_triangles  of the surfaces together
Scene scene(const std::vector<ReportedObject<3>>& objects, Eigen::Index most_triangles);

/// "#4e9ad4"
std::string colour_of(std::size_t n);

}  // namespace surfseg::report
