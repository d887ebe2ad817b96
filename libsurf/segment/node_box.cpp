#include "libsurf/segment/node_box.h"

#include <algorithm>
#include <limits>

namespace surf::segment {

template <int Dim>
NodeBox<Dim> bounds(const NodeBox<Dim>& box, const Flags& flags, int margin) {
  typename NodeBox<Dim>::Index low = box.size, high;
  high.fill(-1);
  for (std::size_t row = 0; row < flags.size(); row += box.size[0]) {
    const auto begin = flags.begin() + std::ptrdiff_t(row), end = begin + box.size[0];
    const auto first = std::find_if(begin, end, [](std::uint8_t flag) { return flag != 0; });
    if (first == end) continue;
    auto last = end - 1;
    while (!*last) --last;
    const auto node = box.node(row);
    low[0] = std::min(low[0], int(first - begin));
    high[0] = std::max(high[0], int(last - begin));
    for (int axis = 1; axis < Dim; ++axis) {
      low[axis] = std::min(low[axis], node[axis] - box.lower[axis]);
      high[axis] = std::max(high[axis], node[axis] - box.lower[axis]);
    }
  }
  NodeBox<Dim> out;
  for (int axis = 0; axis < Dim; ++axis) {
    const int first = std::max(low[axis] - margin, 0),
              last = std::min(high[axis] + margin, box.size[axis] - 1);
    out.lower[axis] = box.lower[axis] + first;
    out.size[axis] = high[axis] < 0 ? 0 : last - first + 1;
  }
  return out;
}

template <int Dim, class T>
std::vector<T> cropped(const NodeBox<Dim>& box, const std::vector<T>& values,
                       const NodeBox<Dim>& part) {
  std::vector<T> out(part.n());
  for (std::size_t at = 0; at < out.size(); at += part.size[0])
    std::copy_n(values.begin() + std::ptrdiff_t(box.at(part.node(at))), part.size[0],
                out.begin() + std::ptrdiff_t(at));
  return out;
}

/// By runs along the first axis: each is looked for once, from the runs beside it.
template <int Dim>
Flags component(const NodeBox<Dim>& box, const Flags& flags, std::vector<std::size_t> starts) {
  Flags out(box.n(), 0);
  while (!starts.empty()) {
    const std::size_t at = starts.back();
    starts.pop_back();
    if (out[at]) continue;
    const std::size_t row = at - at % box.size[0];
    std::size_t first = at, last = at;
    while (first > row && flags[first - 1]) --first;
    while (last + 1 < row + box.size[0] && flags[last + 1]) ++last;
    std::fill(out.begin() + std::ptrdiff_t(first), out.begin() + std::ptrdiff_t(last) + 1, 1);
    const auto push_runs = [&](std::size_t from, std::size_t to) {
      for (std::size_t next = from; next <= to; ++next)
        if (flags[next] && !out[next] && (next == from || !flags[next - 1] || out[next - 1]))
          starts.push_back(next);
    };
    const auto node = box.node(row);
    std::size_t stride = box.size[0];
    for (int axis = 1; axis < Dim; stride *= box.size[axis], ++axis) {
      const int here = node[axis] - box.lower[axis];
      if (here > 0) push_runs(first - stride, last - stride);
      if (here + 1 < box.size[axis]) push_runs(first + stride, last + stride);
    }
  }
  return out;
}

template <int Dim>
std::vector<std::int16_t> squared_distances(const NodeBox<Dim>& box, const Flags& flags,
                                            int reach) {
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
  explicit Envelope(int longest) : values_(longest), center_(longest), from_(longest) {}

  /// values[i] becomes min over j of (i - j)^2 + values[j].
  void replace(float* values, int n, std::size_t stride) {
    int last = -1;
    for (int j = 0; j < n; ++j) {
      values_[j] = values[j * stride];
      if (values_[j] == kFar) continue;
      double begin = -1;
      for (; last >= 0; --last) {
        const int k = center_[last];
        begin = (double(values_[j]) - double(values_[k]) + double(j) * j - double(k) * k) /
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
      values[i * stride] = away * away + values_[center_[at]];
    }
  }

 private:
  std::vector<float> values_;
  std::vector<int> center_;
  std::vector<double> from_;
};

}  // namespace

template <int Dim>
std::vector<float> exact_squared_distances(const NodeBox<Dim>& box, const Flags& flags) {
  std::vector<float> out(box.n());
  std::transform(flags.begin(), flags.end(), out.begin(),
                 [](std::uint8_t flag) { return flag ? 0.f : kFar; });
  Envelope envelope(*std::max_element(box.size.begin(), box.size.end()));
  std::size_t stride = 1;
  for (int axis = 0; axis < Dim; stride *= box.size[axis], ++axis)
    for (std::size_t line = 0; line < out.size(); ++line)
      if (line / stride % box.size[axis] == 0) envelope.replace(&out[line], box.size[axis], stride);
  return out;
}

template <int Dim>
void fill_holes(const NodeBox<Dim>& box, Flags& flags) {
  Flags open(box.n());
  std::transform(flags.begin(), flags.end(), open.begin(),
                 [](std::uint8_t flag) { return std::uint8_t(!flag); });
  std::vector<std::size_t> at_border;
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t) {
      if (open[at] && (here == 0 || here + 1 == box.size[axis])) at_border.push_back(at);
    });
  open = component(box, open, std::move(at_border));
  std::transform(open.begin(), open.end(), flags.begin(),
                 [](std::uint8_t is_open) { return std::uint8_t(!is_open); });
}

template <int Dim>
Flags closed(const NodeBox<Dim>& box, const Flags& flags) {
  Flags grown = flags;
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      if (here + 1 == box.size[axis]) return;
      grown[at] |= flags[at + stride];
      grown[at + stride] |= flags[at];
    });
  Flags out = grown;
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      if (here + 1 == box.size[axis]) return;
      out[at] &= grown[at + stride];
      out[at + stride] &= grown[at];
    });
  for (std::size_t at = 0; at < out.size(); ++at) out[at] |= flags[at];
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

#define SURF_INSTANTIATE(Dim)                                                                     \
  template NodeBox<Dim> bounds<Dim>(const NodeBox<Dim>&, const Flags&, int);                      \
  template std::vector<float> cropped<Dim, float>(const NodeBox<Dim>&, const std::vector<float>&, \
                                                  const NodeBox<Dim>&);                           \
  template std::vector<std::uint16_t> cropped<Dim, std::uint16_t>(                                \
      const NodeBox<Dim>&, const std::vector<std::uint16_t>&, const NodeBox<Dim>&);               \
  template Flags cropped<Dim, std::uint8_t>(const NodeBox<Dim>&, const Flags&,                    \
                                            const NodeBox<Dim>&);                                 \
  template Flags component<Dim>(const NodeBox<Dim>&, const Flags&, std::vector<std::size_t>);     \
  template std::vector<std::int16_t> squared_distances<Dim>(const NodeBox<Dim>&, const Flags&,    \
                                                            int);                                 \
  template std::vector<float> exact_squared_distances<Dim>(const NodeBox<Dim>&, const Flags&);    \
  template Flags closed<Dim>(const NodeBox<Dim>&, const Flags&);                                  \
  template void fill_holes<Dim>(const NodeBox<Dim>&, Flags&);                                     \
  template void blur<Dim>(const NodeBox<Dim>&, std::vector<float>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
