// The planar graph of curves that meet, shared between sources of this library.
#pragma once

#include <map>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "libcurve/mesh/detail/winding_rays.h"
#include "libcurve/mesh/intersections.h"
#include "libsurf/base/types.h"

namespace surf::curve {

/// A piece of one or several elements between two vertices, in the direction of most of them.
struct Piece {
  int from, to;
  int winding;    ///< the winding number grows by this from right to left, > 0
  bool is_real;   ///< part of a curve, not only of bridges
  bool is_whole;  ///< an element that meets no other
};

/// Elements split where they meet. Vertices are the nodes, by their numbers, and then the points
/// that are none; pieces that lie on each other are one, and those that cancel are none.
class PlanarPieces {
 public:
  /// @param curves  must outlive this object
  /// @param pairs   intersections() of the curves
  /// @param n_real  elements from here on are no curves but bridges
  PlanarPieces(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real);

  const std::vector<Piece>& pieces() const { return pieces_; }
  int n_vertices() const { return static_cast<int>(curves_.points.rows() + extra_.size()); }
  ExactPoint exact(int vertex) const;
  Vector<2> rounded(int vertex) const;
  /// Pieces of each element along it; those against its direction, that cancelled or have no length
  /// are -1.
  std::span<const int> along(int element) const {
    if (slot_[element] >= 0) return along_split_[slot_[element]];
    return {&whole_[element], 1};
  }

 private:
  struct Less {
    bool operator()(const ExactPoint& a, const ExactPoint& b) const {
      return CGAL::compare_xy(a, b) == CGAL::SMALLER;
    }
  };

  ExactPoint node(int i) const { return exact_point(curves_.points, i); }
  void find_vertices(const std::vector<ElementPair>& pairs);
  void split(int e, int f);
  void find_pieces();
  /// The vertices along an element that is split.
  std::vector<int> vertices_along(int e) const;
  /// A node that is an end of elements that are split is the vertex at its place.
  int vertex_of(int i) const;

  const Segments& curves_;
  int n_real_;
  std::vector<int> split_, slot_;  // elements that meet others, and where they stand there or -1
  std::map<ExactPoint, int, Less> vertex_at_;
  std::unordered_map<int, int> vertex_of_node_;  // of nodes of elements that meet others
  std::vector<ExactPoint> extra_;                // vertices that are no nodes
  std::vector<std::vector<int>> points_on_, chains_, along_split_;  // by slot
  std::vector<Piece> pieces_;
  std::vector<int> whole_;  // the piece of an element that meets no other
};

}  // namespace surf::curve
