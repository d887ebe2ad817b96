#include "libsurf/io/space.h"

#include <fmt/format.h>

#include <cctype>

#include "libsurf/base/error.h"

namespace surf::io {

std::string_view name(Space space) { return space == Space::kLps ? "LPS" : "RAS"; }

std::optional<Space> stated_space(std::string_view header, const std::string& path) {
  constexpr std::string_view kKey = "SPACE=";
  const std::size_t at = header.find(kKey);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view rest = header.substr(at + kKey.size());
  std::size_t length = 0;
  while (length < rest.size() && std::isalnum(static_cast<unsigned char>(rest[length]))) ++length;
  const std::string_view word = rest.substr(0, length);
  for (const Space space : {Space::kLps, Space::kRas})
    if (word == name(space)) return space;
  throw InputError(fmt::format("{}: the header states SPACE={}; expected LPS or RAS", path, word));
}

Points<3> converted(const Points<3>& points, Space space) {
  Points<3> result = points;
  if (space == Space::kLps) result.leftCols<2>() *= -1.0;
  return result;
}

}  // namespace surf::io
