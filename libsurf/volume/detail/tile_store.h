// Blocks of floats that are computed where they are first asked for, by any thread, and kept.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

namespace surf::volume {

class TileStore {
 public:
  TileStore(std::size_t n_tiles, std::size_t n_values) : tiles_(n_tiles), n_values_(n_values) {}
  ~TileStore() {
    for (auto& tile : tiles_) delete[] tile.load();
  }

  /// Two threads may both compute a tile; they get the same values, and one of the two is dropped.
  /// @param compute  fills n_values floats; a pure function of `at`
  template <class Compute>
  const float* tile(std::size_t at, const Compute& compute) {
    auto& slot = tiles_[at];
    if (const float* ready = slot.load(std::memory_order_acquire)) return ready;
    std::unique_ptr<float[]> fresh(new float[n_values_]);
    compute(fresh.get());
    float* expected = nullptr;
    if (slot.compare_exchange_strong(expected, fresh.get(), std::memory_order_acq_rel)) {
      n_computed_.fetch_add(1, std::memory_order_relaxed);
      return fresh.release();
    }
    return expected;
  }

  std::size_t n_computed() const { return n_computed_.load(); }
  std::size_t memory_bytes() const {
    return n_computed() * n_values_ * sizeof(float) + tiles_.size() * sizeof(std::atomic<float*>);
  }

 private:
  std::vector<std::atomic<float*>> tiles_;
  std::size_t n_values_;
  std::atomic<std::size_t> n_computed_{0};
};

}  // namespace surf::volume
