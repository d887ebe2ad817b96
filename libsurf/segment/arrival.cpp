#include "libsurf/segment/arrival.h"

#include <cmath>
#include <limits>
#include <queue>

namespace surf::segment {
namespace {

template <int Dim>
struct Step {
  std::array<int, Dim> by;
  std::ptrdiff_t jump;
  float half_length;  // [nodes]
};

template <int Dim>
std::vector<Step<Dim>> steps(const NodeBox<Dim>& box) {
  const auto around = NodeBox<Dim>::cube(-1, 3);
  std::vector<Step<Dim>> out;
  for (std::size_t n = 0; n < around.n(); ++n) {
    Step<Dim> step{around.node(n), 0, 0};
    int squared = 0;
    std::ptrdiff_t stride = 1;
    for (int axis = 0; axis < Dim; stride *= box.size[axis], ++axis) {
      squared += step.by[axis] * step.by[axis];
      step.jump += step.by[axis] * stride;
    }
    step.half_length = 0.5f * std::sqrt(float(squared));
    if (squared > 0) out.push_back(step);
  }
  return out;
}

/// @param cost_of  of a step of half a length from one node to another
template <int Dim, class Cost>
std::vector<float> times(const NodeBox<Dim>& box, std::span<const std::size_t> starts,
                         std::size_t max_nodes, const Cost& cost_of) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  using Entry = std::pair<float, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  std::vector<float> out(box.n(), kNever);
  for (const std::size_t at : starts) {
    out[at] = 0;
    front.push({0.f, std::uint32_t(at)});
  }
  const std::vector<Step<Dim>> around = steps(box);
  std::size_t n_done = 0;
  float last = 0;
  while (!front.empty()) {
    const auto [time, at] = front.top();
    if (n_done >= max_nodes && time > last) break;
    front.pop();
    if (time > out[at]) continue;
    last = time;
    ++n_done;
    auto node = box.node(at);
    for (int axis = 0; axis < Dim; ++axis) node[axis] -= box.lower[axis];
    for (const Step<Dim>& step : around) {
      bool is_in_box = true;
      for (int axis = 0; axis < Dim; ++axis) {
        const int there = node[axis] + step.by[axis];
        is_in_box &= there >= 0 && there < box.size[axis];
      }
      if (!is_in_box) continue;
      const std::size_t next = at + std::size_t(step.jump);
      const float later = time + cost_of(at, next, step.half_length);
      if (later >= out[next]) continue;
      out[next] = later;
      front.push({later, std::uint32_t(next)});
    }
  }
  for (float& time : out)
    if (time > last) time = kNever;
  return out;
}

}  // namespace

template <int Dim>
std::vector<float> arrival_times(const NodeBox<Dim>& box, const std::vector<float>& cost,
                                 std::span<const std::size_t> starts, std::size_t max_nodes) {
  return times(box, starts, max_nodes, [&](std::size_t from, std::size_t to, float half_length) {
    return half_length * (cost[from] + cost[to]);
  });
}

template <int Dim>
std::vector<float> geodesic_distances(const NodeBox<Dim>& box, const std::vector<float>& values,
                                      std::span<const std::size_t> starts, float length) {
  return times(box, starts, box.n(), [&](std::size_t from, std::size_t to, float half_length) {
    return 2 * half_length * length + std::abs(values[to] - values[from]);
  });
}

template std::vector<float> arrival_times<2>(const NodeBox<2>&, const std::vector<float>&,
                                             std::span<const std::size_t>, std::size_t);
template std::vector<float> arrival_times<3>(const NodeBox<3>&, const std::vector<float>&,
                                             std::span<const std::size_t>, std::size_t);
template std::vector<float> geodesic_distances<2>(const NodeBox<2>&, const std::vector<float>&,
                                                  std::span<const std::size_t>, float);
template std::vector<float> geodesic_distances<3>(const NodeBox<3>&, const std::vector<float>&,
                                                  std::span<const std::size_t>, float);

}  // namespace surf::segment
