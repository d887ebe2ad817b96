#include "libsurf/base/nearest_name.h"

#include <algorithm>
#include <vector>

namespace surf {
namespace {

/// Optimal string alignment: letters added, left out, changed or swapped with their neighbour.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min(
          {d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + std::size_t(a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::optional<std::string> nearest_name(const std::string& word,
                                        std::span<const std::string> names) {
  std::optional<std::string> nearest, completed;
  std::size_t least = std::min(word.size(), std::max<std::size_t>(1, word.size() / 3) + 1);
  for (const std::string& name : names) {
    if (!completed && word.size() >= 3 && name.starts_with(word)) completed = name;
    if (const std::size_t here = distance(word, name); here < least) {
      least = here;
      nearest = name;
    }
  }
  return nearest ? nearest : completed;
}

std::string did_you_mean(const std::string& word, std::span<const std::string> names) {
  const auto name = nearest_name(word, names);
  return name ? "; did you mean '" + *name + "'?" : "";
}

}  // namespace surf
