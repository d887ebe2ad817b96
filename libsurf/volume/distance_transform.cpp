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

template <std::size_t Dim>
std::vector<float> squared_distances(const std::array<int, Dim>& size,
                                     const std::vector<std::uint8_t>& set) {
  std::vector<float> out(set.size());
  std::transform(set.begin(), set.end(), out.begin(),
                 [](std::uint8_t flag) { return flag ? 0.f : kInfiniteDistance; });
  Line line(*std::max_element(size.begin(), size.end()));
  std::size_t stride = 1;
  for (const int n : size) {
    for (std::size_t block = 0; block < out.size(); block += stride * n)
      for (std::size_t i = 0; i < stride; ++i) line.transform(&out[block + i], n, stride);
    stride *= n;
  }
  return out;
}

template std::vector<float> squared_distances(const std::array<int, 2>&,
                                              const std::vector<std::uint8_t>&);
template std::vector<float> squared_distances(const std::array<int, 3>&,
                                              const std::vector<std::uint8_t>&);

}  // namespace surf::volume
