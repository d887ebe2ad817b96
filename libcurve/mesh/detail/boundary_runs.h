// The boundary of a domain in runs between crossings, shared between sources of this library.
#pragma once

#include <set>
#include <vector>

#include "libcurve/mesh/detail/planar_pieces.h"

namespace surf::curve {

/// Pieces one after the other through vertices where nothing else is.
struct Run {
  std::vector<int> pieces;
  int from = 0, to = 0;  ///< vertices; equal if nothing else is met anywhere
  bool is_kept = false;
  bool is_real = false;
  bool is_loop = false;  ///< meets nothing
};

/// Which runs bound the domain round which the curves wind, and which of these follow each other.
class BoundaryRuns {
 public:
  /// See PlanarPieces.
  BoundaryRuns(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real);

  const PlanarPieces& graph() const { return graph_; }
  const Piece& piece(int p) const { return graph_.pieces()[p]; }
  const std::vector<Run>& runs() const { return runs_; }
  int run_of(int piece) const { return run_of_[piece]; }
  /// Of a kept run.
  int next(int run) const { return next_run_[run]; }
  /// Whether the corner at the end of a kept run touches a wider one, from which it is to be cut.
  bool is_cut(int run) const { return is_cut_.count(run) > 0; }
  double length(int piece) const;

 private:
  struct Spoke;

  void find_runs();
  void decide_runs();
  void link_runs();
  void separate(int vertex, const std::vector<int>& in, const std::vector<int>& out);

  const Segments& curves_;
  PlanarPieces graph_;
  std::vector<int> run_of_;  // of each piece
  std::vector<Run> runs_;
  std::vector<int> next_run_;
  std::set<int> is_cut_;
};

}  // namespace surf::curve
