#include "libsurf/base/padding.h"

#include <algorithm>
#include <cmath>

namespace surf {
namespace {

constexpr int kLinesAlongAxis = 32;  // at most, of those that are looked at
// Of the lines, at the layer where a frame ends: of those through a cylinder of 20 cells a third
// end where it is widest.
constexpr double kLeastThatEnd = 0.5;
constexpr double kMostOfOneValue = 0.5;  // of those that end there
constexpr int kLeastCells = 3;           // that frames leave along an axis

template <int Dim>
class Padding {
 public:
  using Index = std::array<int, Dim>;
  using Values = std::function<std::vector<float>(const Index&, const Index&)>;

  Padding(const Index& size, const Values& values) : size_(size), values_(values) {}

  IndexBox<Dim> box() const {
    Index lower{}, upper = size_;
    for (int axis = 0; axis < Dim; ++axis) {
      const std::vector<std::vector<float>> lines = lines_along(axis);
      const int before = width(axis, lines, false), after = width(axis, lines, true);
      if (size_[axis] - before - after < std::min(kLeastCells, size_[axis])) continue;
      lower[axis] = before;
      upper[axis] -= after;
    }
    return IndexBox<Dim>::between(lower, upper);
  }

 private:
  /// Spread over the image.
  std::vector<std::vector<float>> lines_along(int axis) const {
    Index count;
    for (int other = 0; other < Dim; ++other)
      count[other] = other == axis ? 1 : std::min(size_[other], kLinesAlongAxis);
    const IndexBox<Dim> lines{{}, count};
    std::vector<std::vector<float>> out;
    for (std::size_t n = 0; n < lines.n(); ++n) {
      Index first = lines.node(n);
      for (int other = 0; other < Dim; ++other)
        first[other] = int((2L * first[other] + 1) * size_[other] / (2L * count[other]));
      first[axis] = 0;
      Index end;
      for (int other = 0; other < Dim; ++other) end[other] = first[other] + 1;
      end[axis] = size_[axis];
      out.push_back(values_(first, end));
    }
    return out;
  }

  /// Of the frame before the first layer or behind the last one; 0 if there is none.
  int width(int axis, const std::vector<std::vector<float>>& lines, bool is_last) const {
    const float value = is_last ? lines.front().back() : lines.front().front();
    std::vector<int> runs;    // of the value, of the lines that have another one
    std::vector<float> then;  // the value after each
    for (const std::vector<float>& line : lines) {
      const auto other = [value](float at) { return at != value; };
      const auto run = is_last ? std::find_if(line.rbegin(), line.rend(), other) - line.rbegin()
                               : std::find_if(line.begin(), line.end(), other) - line.begin();
      if (run == 0) return 0;
      if (run == std::ptrdiff_t(line.size())) continue;
      runs.push_back(int(run));
      then.push_back(is_last ? line[line.size() - 1 - std::size_t(run)] : line[std::size_t(run)]);
    }
    if (runs.empty()) return 0;
    const int least = *std::min_element(runs.begin(), runs.end());
    std::vector<float> at_end;
    for (std::size_t n = 0; n < runs.size(); ++n)
      if (runs[n] == least) at_end.push_back(then[n]);
    if (double(at_end.size()) < kLeastThatEnd * double(runs.size())) return 0;
    if (double(most_of_one(at_end)) > kMostOfOneValue * double(at_end.size())) return 0;
    return is_all(axis, is_last ? size_[axis] - least : 0, least, value) ? least : 0;
  }

  /// How many of them have the value that most of them have.
  static std::size_t most_of_one(std::vector<float> values) {
    std::sort(values.begin(), values.end());
    std::size_t out = 0;
    for (auto first = values.begin(); first != values.end();) {
      const auto end = std::upper_bound(first, values.end(), *first);
      out = std::max(out, std::size_t(end - first));
      first = end;
    }
    return out;
  }

  /// Whether so many layers have the value alone.
  bool is_all(int axis, int first, int n, float value) const {
    Index lower{}, upper = size_;
    for (int layer = first; layer < first + n; ++layer) {
      lower[axis] = layer;
      upper[axis] = layer + 1;
      const std::vector<float> there = values_(lower, upper);
      if (!std::all_of(there.begin(), there.end(), [value](float at) { return at == value; }))
        return false;
    }
    return true;
  }

  const Index& size_;
  const Values& values_;
};

}  // namespace

template <int Dim>
IndexBox<Dim> box_within_padding(
    const std::array<int, Dim>& size,
    const std::function<std::vector<float>(const std::array<int, Dim>&,
                                           const std::array<int, Dim>&)>& values) {
  return Padding<Dim>(size, values).box();
}

template IndexBox<2> box_within_padding<2>(
    const std::array<int, 2>&,
    const std::function<std::vector<float>(const std::array<int, 2>&, const std::array<int, 2>&)>&);
template IndexBox<3> box_within_padding<3>(
    const std::array<int, 3>&,
    const std::function<std::vector<float>(const std::array<int, 3>&, const std::array<int, 3>&)>&);

}  // namespace surf
