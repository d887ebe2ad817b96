#include "libcurve/mesh/detail/planar_pieces.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surf::curve {
namespace {

std::vector<ExactPoint> common_of(const ExactKernel::Segment_2& a,
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

}  // namespace

PlanarPieces::PlanarPieces(const Segments& curves, const std::vector<ElementPair>& pairs,
                           int n_real)
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

ExactPoint PlanarPieces::exact(int vertex) const {
  const auto n = curves_.points.rows();
  return vertex < n ? exact_point(curves_.points, vertex) : extra_[vertex - n];
}

Vector<2> PlanarPieces::rounded(int vertex) const {
  if (vertex < curves_.points.rows()) return curves_.points.row(vertex);
  const ExactPoint& p = extra_[vertex - curves_.points.rows()];
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y())};
}

void PlanarPieces::find_vertices(const std::vector<ElementPair>& pairs) {
  for (const int e : split_)
    for (const int i : curves_.elements.row(e)) {
      const auto at = vertex_at_.try_emplace(node(i), i).first;
      vertex_of_node_[i] = at->second;
    }
  for (const auto& [e, f] : pairs) split(e, f);
}

void PlanarPieces::split(int e, int f) {
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

void PlanarPieces::find_pieces() {
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

int PlanarPieces::vertex_of(int i) const {
  const auto at = vertex_of_node_.find(i);
  return at == vertex_of_node_.end() ? i : at->second;
}

std::vector<int> PlanarPieces::vertices_along(int e) const {
  std::vector<int> out = points_on_[slot_[e]];
  out.push_back(vertex_of(curves_.elements(e, 0)));
  out.push_back(vertex_of(curves_.elements(e, 1)));
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  const bool is_forward =
      CGAL::compare_xy(node(curves_.elements(e, 0)), node(curves_.elements(e, 1))) == CGAL::SMALLER;
  std::sort(out.begin(), out.end(),
            [&](int a, int b) { return Less()(exact(a), exact(b)) == is_forward && a != b; });
  return out;
}

}  // namespace surf::curve
