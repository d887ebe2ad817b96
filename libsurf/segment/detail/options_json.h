// Options as JSON, for recipes.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "libsurf/segment/options.h"

namespace surf::segment {

/// Every field that differs from its default, under its name; numbers to their last bit.
template <int Dim>
nlohmann::ordered_json to_json(const Options<Dim>& options);

/// The other way round.
/// @throws InputError  an unknown field, or a value of another type
template <int Dim>
Options<Dim> options_from_json(const nlohmann::ordered_json& json);

/// Its coordinates.
template <int Dim>
nlohmann::ordered_json point_to_json(const Vector<Dim>& point) {
  return std::vector<double>(point.begin(), point.end());
}

/// "points" and "elements".
template <int Dim>
nlohmann::ordered_json shape_to_json(const Simplices<Dim>& shape);
template <int Dim>
Simplices<Dim> shape_from_json(const nlohmann::ordered_json& json);

}  // namespace surf::segment
