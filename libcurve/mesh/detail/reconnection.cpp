#include "libcurve/mesh/detail/reconnection.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <unordered_map>

#include "libcurve/mesh/detail/winding_rays.h"

namespace surf::curve {
namespace {

constexpr double kCut = 0.02;    // of the scale: by which touching corners are cut
constexpr double kShare = 0.25;  // and of their sides, at most

double cross(const Vector<2>& a, const Vector<2>& b) { return a[0] * b[1] - a[1] * b[0]; }

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int i, int j) { parent_[std::max(find(i), find(j))] = std::min(find(i), find(j)); }

 private:
  std::vector<int> parent_;
};

struct Less {
  bool operator()(const ExactPoint& a, const ExactPoint& b) const {
    return CGAL::compare_xy(a, b) == CGAL::SMALLER;
  }
};

/// A piece of one or several elements between two vertices, in the direction of most of them.
struct Piece {
  int from, to;
  int winding;    ///< the winding number grows by this from right to left, > 0
  bool is_real;   ///< part of a curve, not only of bridges
  bool is_whole;  ///< an element that meets no other
};

/// The planar graph of all pieces.
class Pieces {
 public:
  Pieces(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real)
      : curves_(curves), n_real_(n_real), slot_(curves.elements.rows(), -1) {
    for (const auto& [e, f] : pairs)
      for (const int element : {e, f})
        if (slot_[element] < 0) {
          slot_[element] = static_cast<int>(split_.size());
          split_.push_back(element);
        }
    points_on_.resize(split_.size());
    chains_.resize(split_.size());
    along_split_.resize(split_.size());
    find_vertices(pairs);
    find_pieces();
  }

  const std::vector<Piece>& pieces() const { return pieces_; }
  int n_vertices() const { return static_cast<int>(curves_.points.rows() + extra_.size()); }
  ExactPoint exact(int vertex) const {
    const auto n = curves_.points.rows();
    return vertex < n ? exact_point(curves_.points, vertex) : extra_[vertex - n];
  }
  Vector<2> rounded(int vertex) const {
    if (vertex < curves_.points.rows()) return curves_.points.row(vertex);
    const ExactPoint& p = extra_[vertex - curves_.points.rows()];
    return {CGAL::to_double(p.x()), CGAL::to_double(p.y())};
  }
  /// Pieces of each element along it; those against its direction, that cancelled or have no length
  /// are -1.
  std::span<const int> along(int element) const {
    if (slot_[element] >= 0) return along_split_[slot_[element]];
    return {&whole_[element], 1};
  }

 private:
  ExactPoint node(int i) const { return exact_point(curves_.points, i); }

  void find_vertices(const std::vector<ElementPair>& pairs) {
    for (const int e : split_)
      for (const int i : curves_.elements.row(e)) {
        const auto at = vertex_at_.try_emplace(node(i), i).first;
        vertex_of_node_[i] = at->second;
      }
    for (const auto& [e, f] : pairs) split(e, f);
  }

  void split(int e, int f) {
    const auto segment = [&](int element) {
      return ExactKernel::Segment_2(node(curves_.elements(element, 0)),
                                    node(curves_.elements(element, 1)));
    };
    const auto common = common_of(segment(e), segment(f));
    for (const ExactPoint& point : common) {
      const int next = n_vertices();
      const auto [at, is_new] = vertex_at_.try_emplace(point, next);
      if (is_new) extra_.push_back(point);
      points_on_[slot_[e]].push_back(at->second);
      points_on_[slot_[f]].push_back(at->second);
    }
  }

  static std::vector<ExactPoint> common_of(const ExactKernel::Segment_2& a,
                                           const ExactKernel::Segment_2& b) {
    // CGAL wants segments with a length.
    if (a.is_degenerate()) return {a.source()};
    if (b.is_degenerate()) return {b.source()};
    const auto common = CGAL::intersection(a, b);
    assert(common && "a pair that does not meet");
    if (const auto* point = boost::get<ExactPoint>(&*common)) return {*point};
    const auto& overlap = boost::get<ExactKernel::Segment_2>(*common);
    return {overlap.source(), overlap.target()};
  }

  void find_pieces() {
    struct Overlap {
      int winding = 0;  // in the direction from the lower to the higher vertex
      bool is_real = false;
    };
    whole_.assign(slot_.size(), -1);
    for (std::size_t e = 0; e < slot_.size(); ++e) {
      if (slot_[e] >= 0) continue;
      const int from = vertex_of(curves_.elements(Eigen::Index(e), 0)),
                to = vertex_of(curves_.elements(Eigen::Index(e), 1));
      if (from == to) continue;  // no length
      whole_[e] = static_cast<int>(pieces_.size());
      pieces_.push_back({from, to, 1, static_cast<int>(e) < n_real_, true});
    }
    std::map<std::pair<int, int>, Overlap> overlaps;
    for (const int e : split_) {
      std::vector<int>& chain = chains_[slot_[e]];
      chain = vertices_along(e);
      for (std::size_t k = 1; k < chain.size(); ++k) {
        Overlap& overlap = overlaps[std::minmax(chain[k - 1], chain[k])];
        overlap.winding += chain[k - 1] < chain[k] ? 1 : -1;
        overlap.is_real |= e < n_real_;
      }
    }
    std::map<std::pair<int, int>, int> piece_at;
    for (const auto& [ends, overlap] : overlaps) {
      if (overlap.winding == 0) continue;
      auto [from, to] = ends;
      if (overlap.winding < 0) std::swap(from, to);
      piece_at[ends] = static_cast<int>(pieces_.size());
      pieces_.push_back({from, to, std::abs(overlap.winding), overlap.is_real, false});
    }
    for (std::size_t slot = 0; slot < split_.size(); ++slot)
      for (std::size_t k = 1; k < chains_[slot].size(); ++k) {
        const int from = chains_[slot][k - 1], to = chains_[slot][k];
        const auto at = piece_at.find(std::minmax(from, to));
        const bool is_along = at != piece_at.end() && pieces_[at->second].from == from;
        along_split_[slot].push_back(is_along ? at->second : -1);
      }
  }

  /// A node that is an end of elements that are split is the vertex at its place.
  int vertex_of(int i) const {
    const auto at = vertex_of_node_.find(i);
    return at == vertex_of_node_.end() ? i : at->second;
  }

  /// The vertices along an element that is split.
  std::vector<int> vertices_along(int e) const {
    std::vector<int> out = points_on_[slot_[e]];
    out.push_back(vertex_of(curves_.elements(e, 0)));
    out.push_back(vertex_of(curves_.elements(e, 1)));
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    const bool is_forward = CGAL::compare_xy(node(curves_.elements(e, 0)),
                                             node(curves_.elements(e, 1))) == CGAL::SMALLER;
    std::sort(out.begin(), out.end(),
              [&](int a, int b) { return Less()(exact(a), exact(b)) == is_forward && a != b; });
    return out;
  }

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

/// Pieces one after the other through vertices where nothing else is.
struct Run {
  std::vector<int> pieces;
  int from = 0, to = 0;  ///< vertices; equal if nothing else is met anywhere
  bool is_kept = false;
  bool is_real = false;
  bool is_loop = false;  ///< meets nothing
};

class Boundary {
 public:
  Boundary(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real, double scale,
           double crumb)
      : curves_(curves),
        n_real_(n_real),
        scale_(scale),
        crumb_(crumb),
        graph_(curves, pairs, n_real) {
    find_runs();
    decide_runs();
    link_runs();
  }

  Reconnection result() {
    Reconnection out;
    build(out);
    out.events = events();
    return out;
  }

 private:
  const Piece& piece(int p) const { return graph_.pieces()[p]; }

  void find_runs() {
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

  double length(int p) const {
    return (graph_.rounded(piece(p).to) - graph_.rounded(piece(p).from)).norm();
  }

  /// One ray per run, to an element that meets no other if there is one.
  void decide_runs() {
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
  void link_runs() {
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

  /// A direction from a vertex along a run.
  struct Spoke {
    ExactKernel::Vector_2 direction;
    int run;
    bool is_out;
  };

  /// Several corners of the domain meet at a vertex: each is closed by itself, and all but the
  /// widest are cut.
  void separate(int vertex, const std::vector<int>& in, const std::vector<int>& out) {
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
      is_cut_[spokes[k].run] = true;
      if (angle > widest_angle) widest = spokes[k].run, widest_angle = angle;
    }
    is_cut_.erase(widest);
  }

  /// Counter-clockwise from a to b, in (0, 2 pi].
  static double angle_between(const ExactKernel::Vector_2& a, const ExactKernel::Vector_2& b) {
    const double ax = CGAL::to_double(a.x()), ay = CGAL::to_double(a.y());
    const double bx = CGAL::to_double(b.x()), by = CGAL::to_double(b.y());
    const double angle = std::atan2(ax * by - ay * bx, ax * bx + ay * by);
    return angle > 0 ? angle : angle + 2 * M_PI;
  }

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
        const int vertex = piece(run.pieces[k]).from;
        out.push_back({vertex, graph_.rounded(vertex)});
      }
      if (run.is_loop) break;
      const Vector<2> corner = graph_.rounded(run.to);
      if (is_cut_.count(r)) {
        const Vector<2> before = graph_.rounded(piece(run.pieces.back()).from);
        const Vector<2> after = graph_.rounded(piece(runs_[next_run_[r]].pieces.front()).to);
        out.push_back({-1, cut(corner, before)});
        out.push_back({-1, cut(corner, after)});
      } else {
        out.push_back({run.to, corner});
      }
      r = next_run_[r];
      if (r == first) break;
    }
    return out;
  }

  Vector<2> cut(const Vector<2>& corner, const Vector<2>& towards) const {
    const double side = (towards - corner).norm();
    if (!(side > 0)) return corner;
    return corner + std::min(kShare, kCut * scale_ / side) * (towards - corner);
  }

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
    std::vector<std::pair<int, int>> elements;
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
        elements.emplace_back(ids[k], ids[(k + 1) % ids.size()]);
    }
    std::sort(elements.begin(), elements.end());
    out.curves = {Points<2>(points.size(), 2), Elements<2>(elements.size(), 2)};
    for (std::size_t i = 0; i < points.size(); ++i)
      out.curves.points.row(Eigen::Index(i)) = points[i];
    for (std::size_t e = 0; e < elements.size(); ++e)
      out.curves.elements.row(Eigen::Index(e)) << elements[e].first, elements[e].second;
  }

  static void drop_repeated(std::vector<Node>& loop) {
    std::vector<Node> out;
    for (const Node& node : loop)
      if (out.empty() || out.back().point != node.point) out.push_back(node);
    while (out.size() > 1 && out.back().point == out.front().point) out.pop_back();
    loop = std::move(out);
  }

  // Events: crossings that pieces off the boundary, bridges and short runs join are one.

  struct Cluster {
    Vector<2> sum = Vector<2>::Zero();
    int n = 0;
    double change = 0;        ///< of the enclosed area
    std::vector<int> ending;  ///< kept runs that end here, before or after
    Vector<2> place() const { return sum / std::max(n, 1); }
  };

  double run_length(const Run& run) const {
    double sum = 0;
    for (const int p : run.pieces) sum += length(p);
    return sum;
  }
  /// Twice the area between a run and the origin.
  double run_area(const Run& run, const Vector<2>& origin) const {
    double sum = 0;
    for (const int p : run.pieces)
      sum += cross(graph_.rounded(piece(p).from) - origin, graph_.rounded(piece(p).to) - origin);
    return sum;
  }

  std::vector<flow::TopologyEvent> events() {
    if (std::all_of(runs_.begin(), runs_.end(), [](const Run& run) { return run.is_loop; }))
      return {};
    const Vector<2> origin = curves_.points.row(0);
    std::vector<double> area(runs_.size());
    for (std::size_t r = 0; r < runs_.size(); ++r) area[r] = run_area(runs_[r], origin);
    const std::vector<int> before = permutation_before(), after = permutation_after();
    std::map<int, Cluster> clusters = find_clusters(area, before, after);
    std::vector<int> current = before;
    for (std::size_t r = 0; r < runs_.size(); ++r)
      if (before[r] >= 0 && !runs_[r].is_loop)
        clusters[cluster_at(runs_[r].to)].ending.push_back(int(r));
    std::vector<flow::TopologyEvent> out;
    std::vector<const Cluster*> in_order;
    for (const auto& [vertex, cluster] : clusters) in_order.push_back(&cluster);
    std::sort(in_order.begin(), in_order.end(), [](const Cluster* a, const Cluster* b) {
      return std::make_pair(a->place()[0], a->place()[1]) <
             std::make_pair(b->place()[0], b->place()[1]);
    });
    for (const Cluster* cluster : in_order) {
      const auto old_cycles = cycles(current, cluster->ending, area);
      for (const int r : cluster->ending) current[r] = after[r];
      const auto new_cycles = cycles(current, cluster->ending, area);
      flow::TopologyEvent event;
      event.kind = kind(old_cycles, new_cycles);
      event.place << cluster->place(), 0;
      event.enclosed_change = cluster->change;
      out.push_back(event);
    }
    return out;
  }

  std::map<int, Cluster> find_clusters(const std::vector<double>& area,
                                       const std::vector<int>& before,
                                       const std::vector<int>& after) {
    DisjointSets sets(graph_.n_vertices());
    for (const Run& run : runs_)
      if (!run.is_loop && (!run.is_kept || !run.is_real || run_length(run) < scale_))
        sets.join(run.from, run.to);
    for (std::size_t r = 0; r < runs_.size(); ++r)
      for (const int next : {before[r], after[r]})
        if (next >= 0) sets.join(runs_[r].to, runs_[next].from);
    cluster_of_.resize(graph_.n_vertices());
    for (int v = 0; v < graph_.n_vertices(); ++v) cluster_of_[v] = sets.find(v);
    std::map<int, Cluster> out;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (runs_[r].is_loop) continue;
      for (const int vertex : {runs_[r].from, runs_[r].to}) {
        Cluster& cluster = out[cluster_at(vertex)];
        cluster.sum += graph_.rounded(vertex);
        ++cluster.n;
      }
      double& change = out[cluster_at(runs_[r].to)].change;
      const int winding = piece(runs_[r].pieces[0]).winding;
      if (!runs_[r].is_real) change += runs_[r].is_kept ? area[r] / 2 : 0;
      if (runs_[r].is_real) change += (runs_[r].is_kept ? 1 - winding : -winding) * area[r] / 2;
    }
    return out;
  }

  int cluster_at(int vertex) const { return cluster_of_[vertex]; }

  /// Of the kept runs of curves: which came next along the old curves.
  std::vector<int> permutation_before() const {
    std::vector<int> out(runs_.size(), -1);
    std::vector<int> starting(curves_.points.rows(), -1);
    for (int e = 0; e < n_real_; ++e) starting[curves_.elements(e, 0)] = e;
    std::vector<char> is_done(n_real_, 0), is_placed(runs_.size(), 0);
    for (int first = 0; first < n_real_; ++first) {
      std::vector<int> sequence;
      for (int e = first; !is_done[e]; e = starting[curves_.elements(e, 1)]) {
        is_done[e] = 1;
        for (const int p : graph_.along(e)) {
          if (p < 0 || !runs_[run_of_[p]].is_kept || is_placed[run_of_[p]]) continue;
          is_placed[run_of_[p]] = 1;
          sequence.push_back(run_of_[p]);
        }
      }
      for (std::size_t k = 0; k < sequence.size(); ++k)
        out[sequence[k]] = sequence[(k + 1) % sequence.size()];
    }
    for (std::size_t r = 0; r < runs_.size(); ++r)  // only where bridges lie on curves
      if (runs_[r].is_kept && runs_[r].is_real && !is_placed[r]) out[r] = int(r);
    return out;
  }

  /// Which comes next along the new ones.
  std::vector<int> permutation_after() const {
    std::vector<int> out(runs_.size(), -1);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!runs_[r].is_kept || !runs_[r].is_real) continue;
      int next = next_run_[r];
      while (!runs_[next].is_real) next = next_run_[next];
      out[r] = next;
    }
    return out;
  }

  /// Signs of the areas of the cycles through these runs, gaps closed by straight lines; without
  /// crumbs.
  std::vector<int> cycles(const std::vector<int>& next, const std::vector<int>& through,
                          const std::vector<double>& area) const {
    const Vector<2> origin = curves_.points.row(0);
    std::vector<int> out;
    std::set<int> left(through.begin(), through.end());
    while (!left.empty()) {
      const int first = *left.begin();
      double sum = 0;
      int r = first;
      do {
        left.erase(r);
        sum += area[r] + cross(graph_.rounded(runs_[r].to) - origin,
                               graph_.rounded(runs_[next[r]].from) - origin);
        r = next[r];
      } while (r != first);
      if (std::abs(sum) / 2 >= crumb_) out.push_back(sum > 0 ? 1 : -1);
    }
    return out;
  }

  static flow::TopologyChange kind(const std::vector<int>& before, const std::vector<int>& after) {
    using enum flow::TopologyChange;
    const auto n_outer = std::count(before.begin(), before.end(), 1);
    if (after.empty()) return kVanishing;
    if (after.size() < before.size())
      return n_outer == 0 || n_outer == Eigen::Index(before.size()) ? kMerging : kInsideOpening;
    if (after.size() > before.size()) {
      const bool is_mixed =
          std::count(after.begin(), after.end(), after[0]) != Eigen::Index(after.size());
      return is_mixed ? kSelfMerging : kSplitting;
    }
    return kSelfCrossing;
  }

  const Segments& curves_;
  int n_real_;
  double scale_, crumb_;
  Pieces graph_;
  std::vector<int> run_of_;  // of each piece
  std::vector<Run> runs_;
  std::vector<int> next_run_;
  std::map<int, bool> is_cut_;  // runs at whose end the corner is cut
  std::vector<char> is_traced_;
  std::vector<int> cluster_of_;
};

}  // namespace

Reconnection reconnect(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real,
                       double scale, double crumb) {
  return Boundary(curves, pairs, n_real, scale, crumb).result();
}

}  // namespace surf::curve
