#include "libcurve/mesh/detail/reconnection.h"

#include <algorithm>
#include <array>

#include "libcurve/mesh/detail/boundary_runs.h"
#include "libcurve/mesh/detail/topology_events.h"
#include "libsurf/base/arrays.h"

namespace surf::curve {
namespace {

constexpr double kCut = 0.02;    // of the scale: by which touching corners are cut
constexpr double kShare = 0.25;  // and of their sides, at most

/// The curves that the kept runs make.
class Loops {
 public:
  Loops(const Segments& curves, const BoundaryRuns& boundary, double scale)
      : curves_(curves),
        boundary_(boundary),
        graph_(boundary.graph()),
        runs_(boundary.runs()),
        scale_(scale) {}

  /// Old nodes come first; nodes at one point that follow each other become one.
  void build(Reconnection& out) {
    is_traced_.assign(runs_.size(), 0);
    std::vector<std::vector<Node>> loops;
    for (int r = 0; r < int(runs_.size()); ++r) {
      if (!runs_[r].is_kept || is_traced_[r]) continue;
      std::vector<Node> loop = loop_from(r);
      drop_repeated(loop);
      if (loop.size() > 2) loops.push_back(std::move(loop));
    }
    const auto n_old = curves_.points.rows();
    std::vector<int> number(n_old, -1);
    std::vector<Vector<2>> points;
    for (const auto& loop : loops)
      for (const Node& node : loop)
        if (node.vertex >= 0 && node.vertex < n_old) number[node.vertex] = 0;
    for (Eigen::Index i = 0; i < n_old; ++i)
      if (number[i] == 0) {
        number[i] = static_cast<int>(points.size());
        out.kept_nodes.push_back(static_cast<int>(i));
        points.emplace_back(curves_.points.row(i));
      }
    std::vector<std::array<int, 2>> elements;
    for (const auto& loop : loops) {
      std::vector<int> ids;
      for (const Node& node : loop) {
        if (node.vertex >= 0 && node.vertex < n_old) {
          ids.push_back(number[node.vertex]);
          continue;
        }
        ids.push_back(static_cast<int>(points.size()));
        points.push_back(node.point);
      }
      for (std::size_t k = 0; k < ids.size(); ++k)
        elements.push_back({ids[k], ids[(k + 1) % ids.size()]});
    }
    std::sort(elements.begin(), elements.end());
    out.curves = {points_of<2>(points), elements_of(elements)};
  }

 private:
  struct Node {
    int vertex = -1;  ///< -1: a new point
    Vector<2> point;
  };

  std::vector<Node> loop_from(int first) {
    std::vector<Node> out;
    for (int r = first;;) {
      is_traced_[r] = 1;
      const Run& run = runs_[r];
      for (std::size_t k = run.is_loop ? 0 : 1; k < run.pieces.size(); ++k) {
        const int vertex = boundary_.piece(run.pieces[k]).from;
        out.push_back({vertex, graph_.rounded(vertex)});
      }
      if (run.is_loop) break;
      const Vector<2> corner = graph_.rounded(run.to);
      if (boundary_.is_cut(r)) {
        const Vector<2> before = graph_.rounded(boundary_.piece(run.pieces.back()).from);
        const Vector<2> after =
            graph_.rounded(boundary_.piece(runs_[boundary_.next(r)].pieces.front()).to);
        out.push_back({-1, cut(corner, before)});
        out.push_back({-1, cut(corner, after)});
      } else {
        out.push_back({run.to, corner});
      }
      r = boundary_.next(r);
      if (r == first) break;
    }
    return out;
  }

  Vector<2> cut(const Vector<2>& corner, const Vector<2>& towards) const {
    const double side = (towards - corner).norm();
    if (!(side > 0)) return corner;
    return corner + std::min(kShare, kCut * scale_ / side) * (towards - corner);
  }

  static void drop_repeated(std::vector<Node>& loop) {
    std::vector<Node> out;
    for (const Node& node : loop)
      if (out.empty() || out.back().point != node.point) out.push_back(node);
    while (out.size() > 1 && out.back().point == out.front().point) out.pop_back();
    loop = std::move(out);
  }

  const Segments& curves_;
  const BoundaryRuns& boundary_;
  const PlanarPieces& graph_;
  const std::vector<Run>& runs_;
  const double scale_;
  std::vector<char> is_traced_;
};

}  // namespace

Reconnection reconnect(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real,
                       double scale, double crumb) {
  const BoundaryRuns boundary(curves, pairs, n_real);
  Reconnection out;
  Loops(curves, boundary, scale).build(out);
  out.events = topology_events(curves, boundary, n_real, scale, crumb);
  return out;
}

}  // namespace surf::curve
