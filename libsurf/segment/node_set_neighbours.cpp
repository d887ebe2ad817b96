// Of sets of nodes what looks at their neighbours: shifts, components, growth.
#include <algorithm>
#include <cmath>

#include "libsurf/segment/node_set.h"

namespace surf::segment {

/// Whole rows from one step away along an axis that is not the first.
template <int Dim>
NodeSet<Dim> NodeSet<Dim>::rows_beside(int axis, int step) const {
  NodeSet out(box_);
  const std::size_t stride = row_stride(axis);
  const std::ptrdiff_t jump = step * std::ptrdiff_t(stride * words_per_row_);
  for (std::size_t row = 0; row < n_rows(); ++row) {
    const int layer = int(row / stride % box_.size[axis]) + step;
    if (layer < 0 || layer >= box_.size[axis]) continue;
    const auto to = std::ptrdiff_t(row * words_per_row_);
    std::copy_n(words_.begin() + to + jump, words_per_row_, out.words_.begin() + to);
  }
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::next_along(int axis) const {
  if (axis != 0) return rows_beside(axis, 1);
  NodeSet out(box_);
  for (std::size_t w = 0; w < words_.size(); ++w) {
    const bool is_last = (w + 1) % words_per_row_ == 0;
    out.words_[w] = words_[w] >> 1 | (is_last ? 0 : words_[w + 1] << (kBits - 1));
  }
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::previous_along(int axis) const {
  if (axis != 0) return rows_beside(axis, -1);
  NodeSet out(box_);
  for (std::size_t w = 0; w < words_.size(); ++w) {
    const bool is_first = w % words_per_row_ == 0;
    out.words_[w] = (words_[w] << 1 | (is_first ? 0 : words_[w - 1] >> (kBits - 1))) & valid(w);
  }
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::faces_along(int axis) const {
  NodeSet out = *this ^ next_along(axis);
  out.erase_layers(axis, box_.size[axis] - 1, box_.size[axis]);
  return out;
}

/// What is reached in a row spreads along the runs of the set, word by word in log2(64) steps.
template <int Dim>
void NodeSet<Dim>::spread_along_row(std::size_t row, NodeSet& reached) const {
  const Word* set = &words_[row * words_per_row_];
  Word* to = &reached.words_[row * words_per_row_];
  const auto spread = [&](std::size_t w, Word from, const auto& shifted) {
    Word found = to[w] | (from & set[w]), way = set[w];
    if (found == 0 || found == way) {
      to[w] = found;
      return;
    }
    for (int n = 1; n < kBits; n *= 2) {
      found |= way & shifted(found, n);
      way &= shifted(way, n);
    }
    to[w] = found;
  };
  Word carry = 0;
  for (std::size_t w = 0; w < words_per_row_; ++w) {
    spread(w, carry, [](Word bits, int n) { return bits << n; });
    carry = to[w] >> (kBits - 1);
  }
  carry = 0;
  for (std::size_t w = words_per_row_; w-- > 0;) {
    spread(w, carry << (kBits - 1), [](Word bits, int n) { return bits >> n; });
    carry = to[w] & 1;
  }
}

/// @param rows     where something is reached that has not spread yet
/// @param reached  of the set
template <int Dim>
NodeSet<Dim> NodeSet<Dim>::reached_from(std::vector<std::size_t> rows, NodeSet reached) const {
  std::vector<std::size_t> next;
  std::vector<bool> waits(n_rows(), false);
  for (const std::size_t row : rows) waits[row] = true;
  while (!rows.empty()) {
    next.clear();
    for (const std::size_t row : rows) {
      waits[row] = false;
      spread_along_row(row, reached);
      std::size_t stride = 1;
      for (int axis = 1; axis < Dim; stride *= box_.size[axis], ++axis) {
        const int here = int(row / stride % box_.size[axis]);
        for (const int step : {-1, 1}) {
          if (here + step < 0 || here + step >= box_.size[axis]) continue;
          const std::size_t beside = step < 0 ? row - stride : row + stride;
          Word added = 0;
          for (std::size_t w = 0; w < words_per_row_; ++w) {
            Word& there = reached.words_[beside * words_per_row_ + w];
            const Word more = reached.words_[row * words_per_row_ + w] &
                              words_[beside * words_per_row_ + w] & ~there;
            there |= more;
            added |= more;
          }
          if (added == 0 || waits[beside]) continue;
          waits[beside] = true;
          next.push_back(beside);
        }
      }
    }
    rows.swap(next);
  }
  return reached;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::component(const std::vector<Index>& starts) const {
  NodeSet reached(box_);
  std::vector<std::size_t> rows;
  for (const Index& start : starts) {
    reached.insert(start);
    rows.push_back(box_.at(start) / box_.size[0]);
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return reached_from(std::move(rows), std::move(reached));
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::closed() const {
  return dilated(1).complement().dilated(1).complement() | *this;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::filled() const {
  const NodeSet open = complement();
  NodeSet inner = open;
  for (int axis = 0; axis < Dim; ++axis) {
    inner.erase_layers(axis, 0, 1);
    inner.erase_layers(axis, box_.size[axis] - 1, box_.size[axis]);
  }
  std::vector<std::size_t> rows(n_rows());
  for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = row;
  return open.reached_from(std::move(rows), open - inner).complement();
}

/// By up to `by` nodes along the first axis, either way.
template <int Dim>
NodeSet<Dim> NodeSet<Dim>::widened(int by) const {
  NodeSet out = *this;
  for (std::size_t w = 0; w < words_.size(); ++w) {
    const std::size_t here = w % words_per_row_;
    const Word before = here == 0 ? 0 : words_[w - 1],
               after = here + 1 == words_per_row_ ? 0 : words_[w + 1];
    for (int n = 1; n <= by; ++n)
      out.words_[w] |=
          words_[w] << n | before >> (kBits - n) | words_[w] >> n | after << (kBits - n);
    out.words_[w] &= valid(w);
  }
  return out;
}

/// Row by row: what a row adds to one that is d away is widened by (r^2 - d^2)^(1/2).
template <int Dim>
NodeSet<Dim> NodeSet<Dim>::dilated(double r) const {
  const int squared = int(std::floor(r * r)), reach = int(std::floor(r));
  std::vector<NodeSet> wider(reach + 1);
  for (int by = 0; by <= reach; ++by) wider[by] = widened(by);
  NodeSet out = wider[reach];
  const auto around = IndexBox<Dim - 1>::cube(-reach, 2 * reach + 1);
  for (std::size_t n = 0; n < around.n(); ++n) {
    const auto step = around.node(n);
    int left = squared;
    std::ptrdiff_t jump = 0, stride = std::ptrdiff_t(words_per_row_);
    std::array<int, Dim> first{}, last{};  // of the rows that have one to take from
    for (int axis = 1; axis < Dim; stride *= box_.size[axis], ++axis) {
      left -= step[axis - 1] * step[axis - 1];
      jump += step[axis - 1] * stride;
      first[axis] = std::max(0, -step[axis - 1]);
      last[axis] = box_.size[axis] - std::max(0, step[axis - 1]);
    }
    if (left < 0 || left == squared) continue;
    const NodeSet& from = wider[std::size_t(std::sqrt(double(left)))];
    const auto add = [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t w = begin; w < end; ++w) out.words_[w] |= from.words_[w + jump];
    };
    const auto row_words = std::ptrdiff_t(words_per_row_);
    if constexpr (Dim == 2) {
      add(first[1] * row_words, last[1] * row_words);
    } else {
      for (int k = first[2]; k < last[2]; ++k) {
        const std::ptrdiff_t slice = k * row_words * box_.size[1];
        add(slice + first[1] * row_words, slice + last[1] * row_words);
      }
    }
  }
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                     \
  template NodeSet<Dim> NodeSet<Dim>::next_along(int) const;                      \
  template NodeSet<Dim> NodeSet<Dim>::previous_along(int) const;                  \
  template NodeSet<Dim> NodeSet<Dim>::faces_along(int) const;                     \
  template NodeSet<Dim> NodeSet<Dim>::component(const std::vector<Index>&) const; \
  template NodeSet<Dim> NodeSet<Dim>::closed() const;                             \
  template NodeSet<Dim> NodeSet<Dim>::filled() const;                             \
  template NodeSet<Dim> NodeSet<Dim>::dilated(double) const;
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
