#include "libcurve/image/detail/raster.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace surf::curve {

void turn_upright(Raster& raster) {
  const int orientation = raster.orientation;
  if (orientation < 2 || orientation > 8) return;
  const bool is_transposed = orientation >= 5;
  const bool is_last_row_first =
                 orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7,
             is_last_column_first =
                 orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const std::array<int, 2> stored = raster.size;
  if (is_transposed) {
    std::swap(raster.size[0], raster.size[1]);
    if (raster.spacing_mm) std::swap((*raster.spacing_mm)[0], (*raster.spacing_mm)[1]);
  }
  const std::vector<float> in = std::move(raster.values);
  raster.values.resize(in.size());
  const int n = raster.n_components;
  for (int j = 0; j < raster.size[1]; ++j)
    for (int i = 0; i < raster.size[0]; ++i) {
      int row = is_transposed ? i : j, column = is_transposed ? j : i;
      if (is_last_row_first) row = stored[1] - 1 - row;
      if (is_last_column_first) column = stored[0] - 1 - column;
      std::copy_n(&in[(std::size_t(row) * stored[0] + column) * n], n,
                  &raster.values[(std::size_t(j) * raster.size[0] + i) * n]);
    }
}

int orientation_of_exif(std::string_view exif) {
  const bool is_little = exif.starts_with("II");
  const auto number = [&](std::size_t at, int n_bytes) -> std::size_t {
    std::size_t out = 0;
    for (int k = 0; k < n_bytes && at + n_bytes <= exif.size(); ++k)
      out |= std::size_t(static_cast<unsigned char>(exif[at + (is_little ? k : n_bytes - 1 - k)]))
             << 8 * k;
    return out;
  };
  constexpr std::size_t kField = 12, kOrientation = 0x112, kShort = 3;  // bytes, tag, type
  const std::size_t fields = number(4, 4), n_fields = number(fields, 2);
  for (std::size_t n = 0; n < n_fields; ++n) {
    const std::size_t field = fields + 2 + n * kField;
    if (field + kField > exif.size()) break;
    if (number(field, 2) != kOrientation || number(field + 2, 2) != kShort) continue;
    const std::size_t value = number(field + 8, 2);
    return value >= 1 && value <= 8 ? int(value) : 1;
  }
  return 1;
}

}  // namespace surf::curve
