#include "libsurf/segment/detail/arrival.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

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

/// A monotone queue of nodes by their time (Ahuja et al. 1990, "Faster algorithms for the shortest
/// path problem"): what is taken out is never later than what is put in after it. Non-negative
/// floats are in the order of their bits. Half the time of std::priority_queue.
class RadixQueue {
 public:
  struct Entry {
    std::uint32_t time_bits, at;
    float time() const { return std::bit_cast<float>(time_bits); }
  };

  void push(float time, std::size_t at) {
    put({std::bit_cast<std::uint32_t>(time), std::uint32_t(at)});
    ++n_;
  }
  bool is_empty() const { return n_ == 0; }
  /// One of the earliest. @pre not empty
  /// @param is_stale  of an entry: what is no longer needed may be left out on the way
  template <class IsStale>
  Entry pop(const IsStale& is_stale) {
    if (buckets_[0].empty()) refill(is_stale);
    const Entry out = buckets_[0].back();
    buckets_[0].pop_back();
    --n_;
    return out;
  }

 private:
  /// By the highest bit in which it differs from the last time that was taken out.
  void put(const Entry& entry) {
    buckets_[std::bit_width(entry.time_bits ^ last_)].push_back(entry);
  }
  /// The earliest entry is never left out.
  template <class IsStale>
  void refill(const IsStale& is_stale) {
    const auto next = std::find_if(buckets_.begin(), buckets_.end(),
                                   [](const auto& bucket) { return !bucket.empty(); });
    last_ = std::min_element(next->begin(), next->end(), [](const Entry& a, const Entry& b) {
              return a.time_bits < b.time_bits;
            })->time_bits;
    moved_.swap(*next);  // its memory is for the bucket that is moved next
    for (const Entry& entry : moved_)
      if (entry.time_bits == last_ || !is_stale(entry))
        put(entry);
      else
        --n_;
    moved_.clear();
  }

  std::array<std::vector<Entry>, 33> buckets_;
  std::vector<Entry> moved_;
  std::uint32_t last_ = 0;
  std::size_t n_ = 0;
};

/// @param cost_of  of a step of half a length from one node to another
template <int Dim, class Cost>
std::vector<float> times(const NodeBox<Dim>& box, std::span<const std::size_t> starts,
                         std::size_t max_nodes, const Cost& cost_of) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  RadixQueue front;
  std::vector<float> out(box.n(), kNever);
  for (const std::size_t at : starts) {
    out[at] = 0;
    front.push(0, at);
  }
  const std::vector<Step<Dim>> around = steps(box);
  std::size_t n_done = 0;
  float last = 0;
  while (!front.is_empty()) {
    const RadixQueue::Entry entry =
        front.pop([&](const RadixQueue::Entry& other) { return other.time() > out[other.at]; });
    const std::size_t at = entry.at;
    const float time = entry.time();
    if (n_done >= max_nodes && time > last) break;
    if (time > out[at]) continue;
    last = time;
    ++n_done;
    auto node = box.node(at);
    bool is_inner = true;
    for (int axis = 0; axis < Dim; ++axis) {
      node[axis] -= box.lower[axis];
      is_inner &= node[axis] > 0 && node[axis] + 1 < box.size[axis];
    }
    for (const Step<Dim>& step : around) {
      if (!is_inner) {
        bool is_in_box = true;
        for (int axis = 0; axis < Dim; ++axis) {
          const int there = node[axis] + step.by[axis];
          is_in_box &= there >= 0 && there < box.size[axis];
        }
        if (!is_in_box) continue;
      }
      const std::size_t next = at + std::size_t(step.jump);
      const float later = time + cost_of(at, next, step.half_length);
      if (later >= out[next]) continue;
      out[next] = later;
      front.push(later, next);
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
