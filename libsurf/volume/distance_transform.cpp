#include "libsurf/volume/distance_transform.h"

#include <algorithm>
#include <limits>

namespace surf::volume {
namespace {

/// One line of nodes: f(q) becomes min_p f(p) + (q - p)^2.
class Line {
 public:
  explicit Line(int longest) : f_(longest), apex_(longest), from_(longest + 1) {}

  void transform(float* values, int n, std::size_t stride) {
    for (int q = 0; q < n; ++q) f_[q] = values[q * stride];
    const int n_parabolas = envelope(n);
    if (n_parabolas == 0) return;
    from_[n_parabolas] = std::numeric_limits<double>::infinity();
    for (int q = 0, k = 0; q < n; ++q) {
      while (from_[k + 1] < q) ++k;
      const float d = static_cast<float>(q - apex_[k]);
      values[q * stride] = d * d + f_[apex_[k]];
    }
  }

 private:
  /// The parabolas of the lower envelope: apex_[k] from from_[k] on. Returns how many.
  int envelope(int n) {
    int k = 0;
    for (int q = 0; q < n; ++q) {
      if (f_[q] >= kInfiniteDistance) continue;
      double start = -std::numeric_limits<double>::infinity();
      for (; k > 0; --k) {
        const int p = apex_[k - 1];
        start = ((f_[q] + double(q) * q) - (f_[p] + double(p) * p)) / (2.0 * (q - p));
        if (start > from_[k - 1]) break;
        start = -std::numeric_limits<double>::infinity();
      }
      apex_[k] = q;
      from_[k] = start;
      ++k;
    }
    return k;
  }

  std::vector<float> f_;
  std::vector<int> apex_;
  std::vector<double> from_;
};

}  // namespace

std::vector<float> squared_distances(const std::array<int, 3>& size,
                                     const std::vector<std::uint8_t>& set) {
  std::vector<float> out(set.size());
  std::transform(set.begin(), set.end(), out.begin(),
                 [](std::uint8_t flag) { return flag ? 0.f : kInfiniteDistance; });
  Line line(*std::max_element(size.begin(), size.end()));
  const std::size_t row = size[0], slice = row * size[1];
  for (std::size_t at = 0; at < out.size(); at += row) line.transform(&out[at], size[0], 1);
  for (int k = 0; k < size[2]; ++k)
    for (std::size_t i = 0; i < row; ++i) line.transform(&out[k * slice + i], size[1], row);
  for (std::size_t i = 0; i < slice; ++i) line.transform(&out[i], size[2], slice);
  return out;
}

}  // namespace surf::volume
