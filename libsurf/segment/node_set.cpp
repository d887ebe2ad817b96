#include "libsurf/segment/node_set.h"

#include <algorithm>

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

template class NodeSet<2>;
template class NodeSet<3>;

}  // namespace surf::segment
