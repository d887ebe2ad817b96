#include "libsurf/volume/cut_cells.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libsurf/fem/trilinear.h"
#include "libsurf/volume/cell_pieces.h"

namespace surf::volume {
namespace {

// A cell with less than this share of it is empty, one with less than this share missing is full.
constexpr double kLeastShare = 1e-10;
// Of the whole cell's mass: far above rounding, far below what a domain can lack.
constexpr double kDefinite = 1e-9;

/// Integrals of y^b z^c at 3 c + b.
using SectionMoments = std::array<double, 9>;

/// A slab of cells with the same k, filled triangle by triangle.
class Slab {
 public:
  Slab(const std::array<int, 3>& size, int k)
      : size_(size), k_(k), slots_(std::size_t(size[0]) * size[1], -1), before_(size[1]) {}

  /// @param sign  1 if the corners are counter-clockwise seen from outside, in the grid's indices
  void add(const Piece& triangle, double sign) {
    Piece piece = triangle, other;
    const auto [first, last] = cells_of(triangle.range(2));
    if (first < k_) split(Piece(piece), 2, k_, other, piece);
    if (last > k_) split(Piece(piece), 2, k_ + 1, piece, other);
    for_cells_along(piece, 1, 0, size_[1] - 1, [&](int j, const Piece& row) {
      if (j < 0) return;
      for_cells_along(row, 0, 0, size_[0] - 1,
                      [&](int i, const Piece& part) { add_part(i, j, part, sign); });
    });
  }

  /// States along the row j; those that are cut are appended with their moments.
  void finish_row(int j, std::int32_t* state, std::vector<Moments>& cut) {
    SectionMoments sum = before_[j];
    for (int i = 0; i < size_[0]; ++i) {
      const int slot = slots_[std::size_t(j) * size_[0] + i];
      if (slot < 0) {
        state[i] = sum[0] > 0.5 ? DomainCells::kFull : DomainCells::kEmpty;
        continue;
      }
      Moments& moments = moments_[slot];
      for (int bc = 0; bc < 9; ++bc) {
        for (int a = 0; a < 3; ++a) moments[bc * 3 + a] += sum[bc] / (a + 1);
        sum[bc] += sections_[slot][bc];
      }
      state[i] = static_cast<std::int32_t>(cut.size());
      cut.push_back(moments);
    }
  }

 private:
  int slot(int i, int j) {
    int& slot = slots_[std::size_t(j) * size_[0] + i];
    if (slot < 0) {
      slot = static_cast<int>(moments_.size());
      moments_.push_back({});
      sections_.push_back({});
    }
    return slot;
  }

  /// Behind the part, seen along i, the domain begins or ends: int_x^1 in its own cell, and
  /// the section of the whole length of all further ones.
  void add_part(int i, int j, const Piece& part, double sign) {
    Moments* moments = nullptr;
    SectionMoments* section = &before_[j];
    if (i >= 0) {
      const int at = slot(i, j);
      moments = &moments_[at];
      section = &sections_[at];
    }
    const Eigen::Vector3d corner(i, j, k_);
    for_triangles_of(part, [&](const PieceCorner& p, const PieceCorner& q, const PieceCorner& r) {
      const Eigen::Vector3d a = p.index - corner, b = q.index - corner, c = r.index - corner;
      const double area = 0.5 * ((b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2]));
      if (area == 0) return;
      const PieceRule& rule = piece_rule();
      for (std::size_t m = 0; m < rule.weights.size(); ++m) {
        const Eigen::Vector3d& l = rule.points[m];
        add_point(l[0] * a + l[1] * b + l[2] * c, -sign * area * rule.weights[m], moments,
                  *section);
      }
    });
  }

  static void add_point(const Eigen::Vector3d& x, double weight, Moments* moments,
                        SectionMoments& section) {
    const double y[3] = {1, x[1], x[1] * x[1]}, z[3] = {1, x[2], x[2] * x[2]};
    const double square = x[0] * x[0];
    const double rest[3] = {1 - x[0], (1 - square) / 2, (1 - square * x[0]) / 3};
    for (int c = 0; c < 3; ++c)
      for (int b = 0; b < 3; ++b) {
        const double w = weight * y[b] * z[c];
        section[c * 3 + b] += w;
        if (!moments) continue;
        for (int a = 0; a < 3; ++a) (*moments)[(c * 3 + b) * 3 + a] += w * rest[a];
      }
  }

  std::array<int, 3> size_;
  int k_;
  std::vector<int> slots_;
  std::vector<Moments> moments_;
  std::vector<SectionMoments> sections_, before_;
};

/// Numbers of the triangles that meet each slab, ascending.
std::vector<std::vector<int>> triangles_of_slabs(const Points<3>& index,
                                                 const Elements<3>& elements, int n_slabs) {
  std::vector<std::vector<int>> out(n_slabs);
  for (int t = 0; t < elements.rows(); ++t) {
    const auto [low, high] =
        std::minmax({index(elements(t, 0), 2), index(elements(t, 1), 2), index(elements(t, 2), 2)});
    const auto [first, last] = cells_of({low, high});
    for (int k = std::max(first, 0); k <= std::min(last, n_slabs - 1); ++k) out[k].push_back(t);
  }
  return out;
}

bool is_definite(const Moments& moments) {
  static const fem::CellMatrix shift = kDefinite * fem::cell_mass(fem::full_moments());
  return Eigen::LLT<fem::CellMatrix>(fem::cell_mass(moments) + shift).info() == Eigen::Success;
}

Moments scaled(const Moments& moments, double factor) {
  Moments out;
  for (std::size_t m = 0; m < out.size(); ++m) out[m] = factor * moments[m];
  return out;
}

Moments complement(const Moments& moments) {
  Moments out;
  for (std::size_t m = 0; m < out.size(); ++m) out[m] = fem::full_moments()[m] - moments[m];
  return out;
}

/// Makes the moments of cut cells those of a part of the cell, and empty and full what is so up to
/// rounding; the outside gets the rest.
void settle(std::vector<std::int32_t>& state, std::vector<Moments>& cut, DomainCells& inside,
            DomainCells& outside, std::size_t first_cell) {
  for (std::size_t n = 0; n < state.size(); ++n) {
    std::int32_t &in = inside.state[first_cell + n], &out = outside.state[first_cell + n];
    in = state[n];
    out = in == DomainCells::kFull ? DomainCells::kEmpty : DomainCells::kFull;
    if (in < 0) continue;
    Moments& moments = cut[in];
    if (!is_definite(moments) || !is_definite(complement(moments)))
      moments = scaled(fem::full_moments(), std::clamp(moments[0], 0.0, 1.0));
    if (moments[0] < kLeastShare)
      in = DomainCells::kEmpty;
    else if (moments[0] > 1 - kLeastShare)
      in = DomainCells::kFull, out = DomainCells::kEmpty;
    else
      out = in;
  }
}

/// Numbers of the cut cells run through all slabs.
void number_cut_cells(std::vector<std::vector<Moments>>& of_slabs, DomainCells& inside,
                      DomainCells& outside) {
  const std::size_t n_slab = std::size_t(inside.size[0]) * inside.size[1];
  for (int k = 0; k < inside.size[2]; ++k) {
    for (std::size_t n = k * n_slab; n < (k + 1) * n_slab; ++n) {
      if (inside.state[n] < 0) continue;
      const Moments& moments = of_slabs[k][inside.state[n]];
      inside.state[n] = outside.state[n] = static_cast<std::int32_t>(inside.moments.size());
      inside.moments.push_back(moments);
      outside.moments.push_back(complement(moments));
    }
    of_slabs[k] = {};
  }
}

/// Coefficients of ((x + offset) / factor)^a for 1, x, x^2.
std::array<std::array<double, 3>, 3> power_of_child(int factor, int offset) {
  const double s = 1.0 / factor, o = offset;
  return {{{1, 0, 0}, {s * o, s, 0}, {s * s * o * o, 2 * s * s * o, s * s}}};
}

/// Adds the moments of a child, in the coordinates of its parent.
void add_child(const Moments& child, const std::array<int, 3>& factor,
               const std::array<int, 3>& offset, Moments& parent) {
  Moments from = child;
  for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3) {
    const auto power = power_of_child(factor[axis], offset[axis]);
    Moments to{};
    for (int m = 0; m < 27; ++m) {
      const int a = m / stride % 3;
      for (int s = 0; s <= a; ++s) to[m] += power[a][s] * from[m + (s - a) * stride];
    }
    from = scaled(to, 1.0 / factor[axis]);
  }
  for (int m = 0; m < 27; ++m) parent[m] += from[m];
}

}  // namespace

std::array<DomainCells, 2> cut_cells(const Points<3>& points, const Elements<3>& elements,
                                     const Grid& grid) {
  const Eigen::Affine3d world_to_index = grid.index_to_world.inverse();
  const double sign = grid.index_to_world.linear().determinant() > 0 ? 1 : -1;
  const Points<3> index = (points * world_to_index.linear().transpose()).rowwise() +
                          world_to_index.translation().transpose();
  DomainCells inside, outside;
  inside.size = {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1};
  outside.size = inside.size;
  const std::size_t n_slab = std::size_t(inside.size[0]) * inside.size[1];
  inside.state.resize(n_slab * inside.size[2]);
  outside.state.resize(inside.state.size());
  const auto triangles = triangles_of_slabs(index, elements, inside.size[2]);
  std::vector<std::vector<Moments>> cut(inside.size[2]);
  tbb::parallel_for(0, inside.size[2], [&](int k) {
    Slab slab(inside.size, k);
    for (const int t : triangles[k])
      slab.add(whole_triangle(index.row(elements(t, 0)), index.row(elements(t, 1)),
                              index.row(elements(t, 2))),
               sign);
    std::vector<std::int32_t> state(n_slab);
    for (int j = 0; j < inside.size[1]; ++j)
      slab.finish_row(j, state.data() + std::size_t(j) * inside.size[0], cut[k]);
    settle(state, cut[k], inside, outside, k * n_slab);
  });
  number_cut_cells(cut, inside, outside);
  return {std::move(inside), std::move(outside)};
}

DomainCells blended(const DomainCells& cells, double share) {
  DomainCells out = cells;
  for (Moments& moments : out.moments) {
    const double volume = moments[0];
    for (std::size_t m = 0; m < moments.size(); ++m)
      moments[m] = (1 - share) * moments[m] + share * volume * fem::full_moments()[m];
  }
  return out;
}

DomainCells coarsened(const DomainCells& fine, const std::array<int, 3>& factor) {
  DomainCells out;
  for (int axis = 0; axis < 3; ++axis)
    out.size[axis] = (fine.size[axis] + factor[axis] - 1) / factor[axis];
  out.state.reserve(std::size_t(out.size[0]) * out.size[1] * out.size[2]);
  const int n_children = factor[0] * factor[1] * factor[2];
  for (int k = 0; k < out.size[2]; ++k)
    for (int j = 0; j < out.size[1]; ++j)
      for (int i = 0; i < out.size[0]; ++i) {
        std::array<std::int32_t, 8> states{};
        std::array<std::array<int, 3>, 8> offsets{};
        for (int n = 0; n < n_children; ++n) {
          offsets[n] = {n % factor[0], n / factor[0] % factor[1], n / (factor[0] * factor[1])};
          states[n] = fine.at(i * factor[0] + offsets[n][0], j * factor[1] + offsets[n][1],
                              k * factor[2] + offsets[n][2]);
        }
        const bool are_same =
            states[0] < 0 && std::all_of(states.begin(), states.begin() + n_children,
                                         [&](std::int32_t state) { return state == states[0]; });
        if (are_same) {
          out.state.push_back(states[0]);
          continue;
        }
        Moments moments{};
        for (int n = 0; n < n_children; ++n)
          if (states[n] != DomainCells::kEmpty)
            add_child(
                states[n] == DomainCells::kFull ? fem::full_moments() : fine.moments[states[n]],
                factor, offsets[n], moments);
        out.state.push_back(static_cast<std::int32_t>(out.moments.size()));
        out.moments.push_back(moments);
      }
  return out;
}

}  // namespace surf::volume
