// Whole numbers of JSON.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>

namespace surf::segment {

/// The JSON library's own conversion of a number that its type cannot hold is undefined.
/// @throws InputError  no number, not whole, or outside lowest..highest
int whole_number(const nlohmann::ordered_json& json, int lowest = std::numeric_limits<int>::min(),
                 int highest = std::numeric_limits<int>::max());

}  // namespace surf::segment
