#include "libsurf/segment/certainty.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <queue>

#include "libsurf/fem/geometry.h"

namespace surf::segment {
namespace {

/// Lengths of the shortest ways along edges from the sources to all vertices (Dijkstra), (n);
/// infinite where none leads.
template <int Dim>
std::vector<double> ways_from(const Simplices<Dim>& shape, const std::vector<char>& is_source) {
  const std::size_t n = is_source.size();
  std::vector<std::vector<int>> neighbours(n);
  for (const auto element : shape.elements.rowwise())
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j)
        if (i != j) neighbours[element[i]].push_back(element[j]);
  std::vector<double> out(n, std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> waiting;
  for (std::size_t i = 0; i < n; ++i)
    if (is_source[i]) waiting.push({out[i] = 0, int(i)});
  while (!waiting.empty()) {
    const auto [way, i] = waiting.top();
    waiting.pop();
    if (way > out[i]) continue;
    for (const int j : neighbours[i]) {
      const double next = way + (shape.points.row(i) - shape.points.row(j)).norm();
      if (next < out[j]) waiting.push({out[j] = next, j});
    }
  }
  return out;
}

template <int Dim>
std::array<double, Dim> key(const Simplices<Dim>& shape, Eigen::Index i) {
  std::array<double, Dim> out;
  for (int axis = 0; axis < Dim; ++axis) out[axis] = shape.points(i, axis);
  return out;
}

template <int Dim>
std::map<std::array<double, Dim>, Eigen::Index> places_of(const Simplices<Dim>& shape) {
  std::map<std::array<double, Dim>, Eigen::Index> out;
  for (Eigen::Index i = 0; i < shape.points.rows(); ++i) out.emplace(key<Dim>(shape, i), i);
  return out;
}

}  // namespace

template <int Dim>
void find_doubt(const Simplices<Dim>& shape, const std::vector<char>& on_border,
                Certainty<Dim>& certainty) {
  const fem::Geometry<Dim> geometry(shape.points, shape.elements);
  std::vector<char> is_sure(certainty.has_edge.size());
  double all = 0, without = 0;
  for (std::size_t i = 0; i < is_sure.size(); ++i) {
    is_sure[i] = certainty.has_edge[i] || on_border[i];
    if (!on_border[i]) all += geometry.lumped_mass()[i];
    if (!is_sure[i]) without += geometry.lumped_mass()[i];
  }
  certainty.share_without_edge = all > 0 ? without / all : 0;
  certainty.next_click_mm.reset();
  const std::vector<double> ways = ways_from<Dim>(shape, is_sure);
  double deepest = 0;
  for (std::size_t i = 0; i < ways.size(); ++i)
    if (ways[i] > deepest) {
      deepest = ways[i];
      certainty.next_click_mm = shape.points.row(Eigen::Index(i)).transpose();
    }
}

template <int Dim>
std::vector<char> are_vertices_of(const Simplices<Dim>& of, const Simplices<Dim>& shape) {
  const auto places = places_of<Dim>(of);
  std::vector<char> out;
  for (Eigen::Index i = 0; i < shape.points.rows(); ++i)
    out.push_back(places.contains(key<Dim>(shape, i)));
  return out;
}

template <int Dim>
Certainty<Dim> amended_certainty(const Certainty<Dim>& known, const Simplices<Dim>& of,
                                 const Certainty<Dim>& anew, const mesh::ShapePart<Dim>& part,
                                 const Simplices<Dim>& shape) {
  const auto places = places_of<Dim>(of);
  const auto n = std::size_t(shape.points.rows());
  std::vector<int> place_in_part(n, -1);
  for (std::size_t k = 0; k < part.vertices.size(); ++k)
    if (!part.is_shared[k]) place_in_part[std::size_t(part.vertices[k])] = int(k);
  Certainty<Dim> out;
  out.deviation_mm.resize(Eigen::Index(n));
  out.edge_strength.resize(Eigen::Index(n));
  out.has_edge.resize(n);
  std::vector<char> on_border(n);
  for (std::size_t i = 0; i < n; ++i) {
    const int at = place_in_part[i];
    const Certainty<Dim>& source = at >= 0 ? anew : known;
    const Eigen::Index from = at >= 0 ? at : places.at(key<Dim>(shape, Eigen::Index(i)));
    out.deviation_mm[Eigen::Index(i)] = source.deviation_mm[from];
    out.edge_strength[Eigen::Index(i)] = source.edge_strength[from];
    out.has_edge[i] = source.has_edge[std::size_t(from)];
    on_border[i] = source.deviation_mm[from] == 0;
  }
  // Parts as if they were independent.
  const double share =
      std::min(1.0, fem::Geometry<Dim>(part.shape.points, part.shape.elements).measure() /
                        fem::Geometry<Dim>(shape.points, shape.elements).measure());
  out.content_deviation =
      std::hypot(std::sqrt(1 - share) * known.content_deviation, anew.content_deviation);
  find_doubt<Dim>(shape, on_border, out);
  return out;
}

template <int Dim>
Certainty<Dim> certainty_of_part(const Certainty<Dim>& certainty, const Simplices<Dim>& of,
                                 const Simplices<Dim>& shape) {
  Certainty<Dim> out = certainty;
  if (shape.points.rows() == of.points.rows() && shape.points == of.points) return out;
  const auto places = places_of<Dim>(of);
  std::vector<char> on_border;
  out.deviation_mm.resize(shape.points.rows());
  out.edge_strength.resize(shape.points.rows());
  out.has_edge.resize(std::size_t(shape.points.rows()));
  for (Eigen::Index i = 0; i < shape.points.rows(); ++i) {
    const Eigen::Index from = places.at(key<Dim>(shape, i));
    out.deviation_mm[i] = certainty.deviation_mm[from];
    out.edge_strength[i] = certainty.edge_strength[from];
    out.has_edge[std::size_t(i)] = certainty.has_edge[std::size_t(from)];
    on_border.push_back(certainty.deviation_mm[from] == 0);
  }
  if (shape.points.rows() == 0) return out;
  // Of what is left, as if the rest were independent of it.
  const double share = std::min(1.0, fem::Geometry<Dim>(shape.points, shape.elements).measure() /
                                         fem::Geometry<Dim>(of.points, of.elements).measure());
  out.content_deviation *= std::sqrt(share);
  find_doubt<Dim>(shape, on_border, out);
  return out;
}

template std::vector<char> are_vertices_of<2>(const Segments&, const Segments&);
template std::vector<char> are_vertices_of<3>(const Triangles&, const Triangles&);
template Certainty<2> amended_certainty<2>(const Certainty<2>&, const Segments&,
                                           const Certainty<2>&, const mesh::ShapePart<2>&,
                                           const Segments&);
template Certainty<3> amended_certainty<3>(const Certainty<3>&, const Triangles&,
                                           const Certainty<3>&, const mesh::ShapePart<3>&,
                                           const Triangles&);
template void find_doubt<2>(const Segments&, const std::vector<char>&, Certainty<2>&);
template void find_doubt<3>(const Triangles&, const std::vector<char>&, Certainty<3>&);
template Certainty<2> certainty_of_part<2>(const Certainty<2>&, const Segments&, const Segments&);
template Certainty<3> certainty_of_part<3>(const Certainty<3>&, const Triangles&, const Triangles&);

}  // namespace surf::segment
