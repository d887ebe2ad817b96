#include "libsurf/segment/node_box.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace surf::segment {

template <int Dim>
std::vector<std::int16_t> squared_distances(const NodeBox<Dim>& box, const Flags& flags,
                                            int reach) {
  assert(reach <= kLongestReach);
  std::vector<std::int16_t> out(box.n());
  const std::size_t row_size = box.size[0];
  for (std::size_t row = 0; row < out.size(); row += row_size) {
    int to_last = reach + 1;
    for (std::size_t at = row; at < row + row_size; ++at) {
      to_last = flags[at] ? 0 : std::min(to_last + 1, reach + 1);
      out[at] = std::int16_t(to_last);
    }
    for (std::size_t at = row + row_size; at-- > row;) {
      to_last = flags[at] ? 0 : std::min(to_last + 1, reach + 1);
      const int nearest = std::min<int>(out[at], to_last);
      out[at] = std::int16_t(nearest * nearest);
    }
  }
  std::size_t stride = row_size;
  for (int axis = 1; axis < Dim; stride *= box.size[axis], ++axis) {
    const std::vector<std::int16_t> before = out;
    for (std::size_t row = 0; row < out.size(); row += row_size) {
      const int here = int(row / stride % box.size[axis]);
      std::int16_t* to = &out[row];
      for (int s = std::max(-reach, -here); s <= std::min(reach, box.size[axis] - 1 - here); ++s) {
        const std::int16_t* from = &before[row] + std::ptrdiff_t(s) * std::ptrdiff_t(stride);
        const auto squared = std::int16_t(s * s);
        for (std::size_t i = 0; i < row_size; ++i)
          to[i] = std::min<std::int16_t>(to[i], std::int16_t(from[i] + squared));
      }
    }
  }
  return out;
}

namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// The lower envelope of parabolas along a line (Felzenszwalb and Huttenlocher).
class Envelope {
 public:
  explicit Envelope(int longest) : before_(longest), center_(longest), from_(longest) {}

  /// values[i] becomes min over j of (i - j)^2 + values[j]. Beyond a 0 nothing is nearer than it,
  /// so that each run between two of them is one for itself.
  void replace(float* values, int n) {
    for (int i = 0; i < n;) {
      if (values[i] == 0) {
        ++i;
        continue;
      }
      const int first = std::max(i - 1, 0);
      while (i < n && values[i] != 0) ++i;
      replace_run(values + first, std::min(i + 1, n) - first);
    }
  }

 private:
  void replace_run(float* values, int n) {
    int last = -1;
    for (int j = 0; j < n; ++j) {
      before_[j] = values[j];
      if (before_[j] == kFar) continue;
      double begin = -1;
      for (; last >= 0; --last) {
        const int k = center_[last];
        begin = (double(before_[j]) - double(before_[k]) + double(j) * j - double(k) * k) /
                (2.0 * (j - k));
        if (begin > from_[last]) break;
      }
      ++last;
      center_[last] = j;
      from_[last] = last == 0 ? -1 : begin;
    }
    if (last < 0) return;
    for (int i = 0, at = 0; i < n; ++i) {
      while (at < last && from_[at + 1] < i) ++at;
      const auto away = float(i - center_[at]);
      values[i] = away * away + before_[center_[at]];
    }
  }

  std::vector<float> before_;
  std::vector<int> center_;
  std::vector<double> from_;
};

}  // namespace

/// Along axes but the first some neighbouring lines at once, one after the other in memory. 112^3
/// nodes, a ball of radius 40: 9.9 ms, 36 with one line at a time and no runs.
template <int Dim>
std::vector<float> exact_squared_distances(const NodeBox<Dim>& box, const Flags& flags) {
  constexpr std::size_t kAtOnce = 16;
  std::vector<float> out(box.n());
  std::transform(flags.begin(), flags.end(), out.begin(),
                 [](std::uint8_t flag) { return flag ? 0.f : kFar; });
  const std::size_t row_size = box.size[0];
  const int longest = *std::max_element(box.size.begin(), box.size.end());
  Envelope envelope(longest);
  for (std::size_t row = 0; row < out.size(); row += row_size)
    envelope.replace(&out[row], box.size[0]);
  std::vector<float> lines(kAtOnce * std::size_t(longest));
  std::size_t stride = row_size;
  for (int axis = 1; axis < Dim; stride *= box.size[axis], ++axis) {
    const std::size_t n = box.size[axis];
    for (std::size_t row = 0; row < out.size(); row += row_size) {
      if (row / stride % n != 0) continue;
      for (std::size_t i = 0; i < row_size; i += kAtOnce) {
        float* first = &out[row + i];
        const std::size_t n_lines = std::min(kAtOnce, row_size - i);
        for (std::size_t k = 0; k < n; ++k)
          for (std::size_t l = 0; l < n_lines; ++l) lines[l * n + k] = first[k * stride + l];
        for (std::size_t l = 0; l < n_lines; ++l) envelope.replace(&lines[l * n], int(n));
        for (std::size_t k = 0; k < n; ++k)
          for (std::size_t l = 0; l < n_lines; ++l) first[k * stride + l] = lines[l * n + k];
      }
    }
  }
  return out;
}

template <int Dim>
void blur(const NodeBox<Dim>& box, std::vector<float>& values) {
  constexpr std::array<float, 5> kBinomial = {1.f / 16, 4.f / 16, 6.f / 16, 4.f / 16, 1.f / 16};
  for (int axis = 0; axis < Dim; ++axis) {
    const std::vector<float> before = values;
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      const std::size_t line = at - here * stride;
      float sum = 0;
      for (int s = -2; s <= 2; ++s)
        sum += kBinomial[s + 2] *
               before[line + std::size_t(std::clamp(here + s, 0, box.size[axis] - 1)) * stride];
      values[at] = sum;
    });
  }
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template std::vector<std::int16_t> squared_distances<Dim>(const NodeBox<Dim>&, const Flags&, \
                                                            int);                              \
  template std::vector<float> exact_squared_distances<Dim>(const NodeBox<Dim>&, const Flags&); \
  template void blur<Dim>(const NodeBox<Dim>&, std::vector<float>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
