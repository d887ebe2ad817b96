#include "libsurf/segment/node_set.h"

#include <algorithm>
#include <cmath>

namespace surf::segment {
namespace {

/// std::popcount() is a call and a table on processors without the instruction, for which we build.
std::size_t n_bits(std::uint64_t word) {
  word -= word >> 1 & 0x5555555555555555;
  word = (word & 0x3333333333333333) + (word >> 2 & 0x3333333333333333);
  word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0f;
  return std::size_t(word * 0x0101010101010101 >> 56);
}

}  // namespace

template <int Dim>
NodeSet<Dim>::NodeSet(const NodeBox<Dim>& box)
    : box_(box), words_per_row_(std::size_t(box.size[0] + kBits - 1) / kBits) {
  if (box.n() > 0) words_.resize(box.n() / box.size[0] * words_per_row_);
}

template <int Dim>
NodeSet<Dim>::NodeSet(const NodeBox<Dim>& box, const Flags& flags)
    : NodeSet(where(box, [&](std::size_t at) { return flags[at] != 0; })) {}

template <int Dim>
typename NodeSet<Dim>::Word NodeSet<Dim>::valid(std::size_t word) const {
  const int n = box_.size[0] - int(word % words_per_row_) * kBits;
  return n >= kBits ? ~Word(0) : (Word(1) << n) - 1;
}

template <int Dim>
std::size_t NodeSet<Dim>::count() const {
  std::size_t out = 0;
  for (const Word word : words_) out += n_bits(word);
  return out;
}

template <int Dim>
std::size_t NodeSet<Dim>::count_in_both(const NodeSet& other) const {
  std::size_t out = 0;
  for (std::size_t w = 0; w < words_.size(); ++w) out += n_bits(words_[w] & other.words_[w]);
  return out;
}

template <int Dim>
bool NodeSet<Dim>::is_empty() const {
  return std::all_of(words_.begin(), words_.end(), [](Word word) { return word == 0; });
}

template <int Dim>
bool NodeSet<Dim>::contains(const Index& node) const {
  if (!box_.contains(node)) return false;
  const std::size_t i = std::size_t(node[0] - box_.lower[0]),
                    row = box_.at(node) / std::size_t(box_.size[0]);
  return words_[row * words_per_row_ + i / kBits] >> i % kBits & 1;
}

template <int Dim>
void NodeSet<Dim>::insert(const Index& node) {
  const std::size_t i = std::size_t(node[0] - box_.lower[0]),
                    row = box_.at(node) / std::size_t(box_.size[0]);
  words_[row * words_per_row_ + i / kBits] |= Word(1) << i % kBits;
}

template <int Dim>
void NodeSet<Dim>::erase(const Index& node) {
  const std::size_t i = std::size_t(node[0] - box_.lower[0]),
                    row = box_.at(node) / std::size_t(box_.size[0]);
  words_[row * words_per_row_ + i / kBits] &= ~(Word(1) << i % kBits);
}

template <int Dim>
Flags NodeSet<Dim>::flags() const {
  Flags out(box_.n(), 0);
  for_each([&](std::size_t at) { out[at] = 1; });
  return out;
}

template <int Dim>
bool NodeSet<Dim>::operator==(const NodeSet& other) const {
  return box_.lower == other.box_.lower && box_.size == other.box_.size && words_ == other.words_;
}

template <int Dim>
NodeSet<Dim>& NodeSet<Dim>::operator&=(const NodeSet& other) {
  for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= other.words_[w];
  return *this;
}

template <int Dim>
NodeSet<Dim>& NodeSet<Dim>::operator|=(const NodeSet& other) {
  for (std::size_t w = 0; w < words_.size(); ++w) words_[w] |= other.words_[w];
  return *this;
}

template <int Dim>
NodeSet<Dim>& NodeSet<Dim>::operator^=(const NodeSet& other) {
  for (std::size_t w = 0; w < words_.size(); ++w) words_[w] ^= other.words_[w];
  return *this;
}

template <int Dim>
NodeSet<Dim>& NodeSet<Dim>::operator-=(const NodeSet& other) {
  for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= ~other.words_[w];
  return *this;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::complement() const {
  NodeSet out = *this;
  for (std::size_t w = 0; w < words_.size(); ++w) out.words_[w] = ~words_[w] & valid(w);
  return out;
}

template <int Dim>
NodeBox<Dim> NodeSet<Dim>::bounds(int margin) const {
  Index low = box_.size, high;
  high.fill(-1);
  for (std::size_t row = 0; row < n_rows(); ++row) {
    const Word* words = &words_[row * words_per_row_];
    std::size_t first = 0, last = words_per_row_;
    while (first < last && words[first] == 0) ++first;
    if (first == last) continue;
    while (words[last - 1] == 0) --last;
    low[0] = std::min(low[0], int(first) * kBits + std::countr_zero(words[first]));
    high[0] =
        std::max(high[0], int(last - 1) * kBits + kBits - 1 - std::countl_zero(words[last - 1]));
    const Index node = box_.node(row * box_.size[0]);
    for (int axis = 1; axis < Dim; ++axis) {
      low[axis] = std::min(low[axis], node[axis] - box_.lower[axis]);
      high[axis] = std::max(high[axis], node[axis] - box_.lower[axis]);
    }
  }
  NodeBox<Dim> out;
  for (int axis = 0; axis < Dim; ++axis) {
    const int first = std::max(low[axis] - margin, 0),
              last = std::min(high[axis] + margin, box_.size[axis] - 1);
    out.lower[axis] = box_.lower[axis] + first;
    out.size[axis] = high[axis] < 0 ? 0 : last - first + 1;
  }
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::in(const NodeBox<Dim>& other) const {
  NodeSet out(other);
  const int offset = other.lower[0] - box_.lower[0];
  const auto n_words = std::ptrdiff_t(words_per_row_);
  for (std::size_t row = 0; row < out.n_rows(); ++row) {
    Index node = other.node(row * other.size[0]);
    node[0] = box_.lower[0];
    if (!box_.contains(node)) continue;
    const Word* from = &words_[box_.at(node) / box_.size[0] * words_per_row_];
    // Bits from `offset` on, which may be before the row.
    const auto word_at = [&](std::ptrdiff_t w) { return w < 0 || w >= n_words ? 0 : from[w]; };
    for (std::size_t w = 0; w < out.words_per_row_; ++w) {
      const std::ptrdiff_t bit = std::ptrdiff_t(w) * kBits + offset,
                           word = bit >= 0 ? bit / kBits : -((-bit + kBits - 1) / kBits);
      const int shift = int(bit - word * kBits);
      const Word bits = shift == 0 ? word_at(word)
                                   : word_at(word) >> shift | word_at(word + 1) << (kBits - shift);
      out.words_[row * out.words_per_row_ + w] = bits & out.valid(w);
    }
  }
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::moved_to(const Index& lower) const {
  NodeSet out = *this;
  out.box_.lower = lower;
  return out;
}

template <int Dim>
void NodeSet<Dim>::erase_layers(int axis, int first, int end) {
  if (axis == 0) {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const int begin = int(w % words_per_row_) * kBits;
      for (int i = std::max(first, begin); i < std::min(end, begin + kBits); ++i)
        words_[w] &= ~(Word(1) << (i - begin));
    }
    return;
  }
  const std::size_t stride = row_stride(axis);
  for (std::size_t row = 0; row < n_rows(); ++row)
    if (const int layer = int(row / stride % box_.size[axis]); layer >= first && layer < end)
      std::fill_n(words_.begin() + std::ptrdiff_t(row * words_per_row_), words_per_row_, Word(0));
}

template <int Dim>
std::size_t NodeSet<Dim>::count_in_layer(int axis, int layer) const {
  std::size_t out = 0;
  const std::size_t stride = axis == 0 ? 1 : row_stride(axis);
  for (std::size_t row = 0; row < n_rows(); ++row) {
    const Word* words = &words_[row * words_per_row_];
    if (axis == 0)
      out += words[layer / kBits] >> layer % kBits & 1;
    else if (int(row / stride % box_.size[axis]) == layer)
      for (std::size_t w = 0; w < words_per_row_; ++w) out += n_bits(words[w]);
  }
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::next_along(int axis) const {
  NodeSet out(box_);
  if (axis == 0) {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const bool is_last = (w + 1) % words_per_row_ == 0;
      out.words_[w] = words_[w] >> 1 | (is_last ? 0 : words_[w + 1] << (kBits - 1));
    }
    return out;
  }
  const std::size_t stride = row_stride(axis), jump = stride * words_per_row_;
  for (std::size_t row = 0; row < n_rows(); ++row)
    if (int(row / stride % box_.size[axis]) + 1 < box_.size[axis])
      for (std::size_t w = row * words_per_row_; w < (row + 1) * words_per_row_; ++w)
        out.words_[w] = words_[w + jump];
  return out;
}

template <int Dim>
NodeSet<Dim> NodeSet<Dim>::previous_along(int axis) const {
  NodeSet out(box_);
  if (axis == 0) {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const bool is_first = w % words_per_row_ == 0;
      out.words_[w] = (words_[w] << 1 | (is_first ? 0 : words_[w - 1] >> (kBits - 1))) & valid(w);
    }
    return out;
  }
  const std::size_t stride = row_stride(axis), jump = stride * words_per_row_;
  for (std::size_t row = 0; row < n_rows(); ++row)
    if (int(row / stride % box_.size[axis]) > 0)
      for (std::size_t w = row * words_per_row_; w < (row + 1) * words_per_row_; ++w)
        out.words_[w] = words_[w - jump];
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

template class NodeSet<2>;
template class NodeSet<3>;

}  // namespace surf::segment
