#include "libsurf/segment/detail/whole_number.h"

#include <fmt/format.h>

#include <cmath>

#include "libsurf/base/error.h"

namespace surf::segment {

int whole_number(const nlohmann::ordered_json& json, int lowest, int highest) {
  const double value = json.is_number() ? json.get<double>() : std::nan("");
  if (!(value >= lowest && value <= highest) || value != std::floor(value))
    throw InputError(
        fmt::format("expected a whole number from {} to {}; got {}", lowest, highest, json.dump()));
  return int(value);
}

}  // namespace surf::segment
