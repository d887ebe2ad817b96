#include "libcurve/mesh/detail/boundary_runs.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "libcurve/mesh/detail/winding_rays.h"
#include "libsurf/base/products.h"

namespace surf::curve {
namespace {

/// Counter-clockwise from a to b, in (0, 2 pi].
double angle_between(const ExactKernel::Vector_2& a, const ExactKernel::Vector_2& b) {
  const auto rounded = [](const ExactKernel::Vector_2& v) {
    return Vector<2>(CGAL::to_double(v.x()), CGAL::to_double(v.y()));
  };
  const double angle = std::atan2(cross(rounded(a), rounded(b)), rounded(a).dot(rounded(b)));
  return angle > 0 ? angle : angle + 2 * M_PI;
}

}  // namespace

/// A direction from a vertex along a run.
struct BoundaryRuns::Spoke {
  ExactKernel::Vector_2 direction;
  int run;
  bool is_out;
};

BoundaryRuns::BoundaryRuns(const Segments& curves, const std::vector<ElementPair>& pairs,
                           int n_real)
    : curves_(curves), graph_(curves, pairs, n_real) {
  find_runs();
  decide_runs();
  link_runs();
}

double BoundaryRuns::length(int p) const {
  return (graph_.rounded(piece(p).to) - graph_.rounded(piece(p).from)).norm();
}

void BoundaryRuns::find_runs() {
  const int n = static_cast<int>(graph_.pieces().size());
  std::vector<int> n_in(graph_.n_vertices(), 0), n_out(n_in), winding_in(n_in), next(n_in);
  for (int p = 0; p < n; ++p) {
    ++n_in[piece(p).to];
    ++n_out[piece(p).from];
    winding_in[piece(p).to] = piece(p).winding;
    next[piece(p).from] = p;
  }
  const auto is_plain = [&](int vertex) {
    return n_in[vertex] == 1 && n_out[vertex] == 1 &&
           winding_in[vertex] == piece(next[vertex]).winding;
  };
  run_of_.assign(n, -1);
  const auto follow = [&](int first, bool is_loop) {
    Run run;
    run.from = piece(first).from;
    run.is_loop = is_loop;
    for (int p = first;;) {
      run.pieces.push_back(p);
      run_of_[p] = static_cast<int>(runs_.size());
      run.is_real |= piece(p).is_real;
      run.to = piece(p).to;
      if (!is_plain(run.to) || run_of_[next[run.to]] >= 0) break;
      p = next[run.to];
    }
    runs_.push_back(std::move(run));
  };
  for (int p = 0; p < n; ++p)
    if (!is_plain(piece(p).from)) follow(p, false);
  for (int p = 0; p < n; ++p)
    if (run_of_[p] < 0) follow(p, true);
}

/// One ray per run, to an element that meets no other if there is one.
void BoundaryRuns::decide_runs() {
  WindingRays rays(curves_.points, curves_.elements);
  for (Run& run : runs_) {
    int best = run.pieces.front();
    for (const int p : run.pieces)
      if (std::make_pair(piece(p).is_whole, length(p)) >
          std::make_pair(piece(best).is_whole, length(best)))
        best = p;
    const auto sides = rays.sides(graph_.exact(piece(best).from), graph_.exact(piece(best).to));
    assert(sides.left - sides.right == piece(best).winding);
    run.is_kept = sides.right < 1 && sides.left >= 1;
  }
}

/// Which kept run follows which.
void BoundaryRuns::link_runs() {
  next_run_.assign(runs_.size(), -1);
  std::map<int, std::vector<int>> starting, ending;
  for (int r = 0; r < int(runs_.size()); ++r) {
    if (!runs_[r].is_kept) continue;
    if (runs_[r].is_loop) {
      next_run_[r] = r;
      continue;
    }
    starting[runs_[r].from].push_back(r);
    ending[runs_[r].to].push_back(r);
  }
  for (const auto& [vertex, in] : ending) {
    const std::vector<int>& out = starting[vertex];
    assert(in.size() == out.size());
    if (in.size() == 1)
      next_run_[in[0]] = out[0];
    else
      separate(vertex, in, out);
  }
}

/// Several corners of the domain meet at a vertex: each is closed by itself, and all but the
/// widest are cut.
void BoundaryRuns::separate(int vertex, const std::vector<int>& in, const std::vector<int>& out) {
  std::vector<Spoke> spokes;
  const ExactPoint centre = graph_.exact(vertex);
  for (const int r : in)
    spokes.push_back({graph_.exact(piece(runs_[r].pieces.back()).from) - centre, r, false});
  for (const int r : out)
    spokes.push_back({graph_.exact(piece(runs_[r].pieces.front()).to) - centre, r, true});
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) {
    return CGAL::compare_angle_with_x_axis(a.direction.direction(), b.direction.direction()) ==
           CGAL::SMALLER;
  });
  int widest = -1;
  double widest_angle = -1;
  for (std::size_t k = 0; k < spokes.size(); ++k) {
    if (spokes[k].is_out) continue;
    // Arriving, the domain is on the left: clockwise from where one came from.
    const Spoke& other = spokes[(k + spokes.size() - 1) % spokes.size()];
    assert(other.is_out);
    next_run_[spokes[k].run] = other.run;
    const double angle = angle_between(other.direction, spokes[k].direction);
    is_cut_.insert(spokes[k].run);
    if (angle > widest_angle) widest = spokes[k].run, widest_angle = angle;
  }
  is_cut_.erase(widest);
}

}  // namespace surf::curve
