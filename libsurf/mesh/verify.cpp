#include "libsurf/mesh/verify.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/base/disjoint_sets.h"
#include "libsurf/mesh/detail/edge_uses.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/self_intersections.h"

namespace surf::mesh {
namespace {

template <class T>
void list(std::vector<T>& listed, const T& offender) {
  if (listed.size() < Verification::kMaxListed) listed.push_back(offender);
}

int n_invalid_triangles(const Triangles& surface) {
  int n = 0;
  for (const auto element : surface.elements.rowwise()) {
    const auto is_bad = [&](int vertex) {
      return vertex < 0 || vertex >= surface.points.rows() ||
             !surface.points.row(vertex).allFinite();
    };
    n += is_bad(element[0]) || is_bad(element[1]) || is_bad(element[2]);
  }
  return n;
}

void check_edges(const std::vector<EdgeUse>& uses, Verification& result) {
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const std::pair<int, int> vertices(edge[0].low, edge[0].high);
    const bool is_point = edge[0].low == edge[0].high;  // of a triangle with two equal corners
    if (edge.size() == 1 && !is_point) {
      ++result.n_border_edges;
      list(result.border_edges, vertices);
    } else if (edge.size() > 2 || is_point) {
      ++result.n_nonmanifold_edges;
      list(result.nonmanifold_edges, vertices);
      const auto n_forward = std::count_if(edge.begin(), edge.end(),
                                           [](const EdgeUse& use) { return use.is_forward; });
      result.n_unbalanced_edges += !is_point && 2 * n_forward != std::ssize(edge);
    } else if (edge[0].is_forward == edge[1].is_forward) {
      ++result.n_misoriented_edges;
    }
  });
}

/// Corner of the triangle of `use` at its edge's low or high vertex.
int corner_at(const EdgeUse& use, bool at_low) {
  return 3 * use.element + (use.is_forward == at_low ? use.corner : (use.corner + 1) % 3);
}

/// A vertex is manifold if the corners round it hang together through edges.
void check_vertices(const Triangles& surface, const std::vector<EdgeUse>& uses,
                    Verification& result) {
  DisjointSets fans(3 * surface.elements.rows());
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    for (std::size_t i = 1; i < edge.size(); ++i)
      for (const bool at_low : {true, false})
        fans.join(corner_at(edge[0], at_low), corner_at(edge[i], at_low));
  });
  std::vector<int> fan_of_vertex(surface.points.rows(), -1);
  std::vector<bool> is_bad(surface.points.rows());
  for (int row = 0; row < surface.elements.rows(); ++row)
    for (int corner = 0; corner < 3; ++corner) {
      const int vertex = surface.elements(row, corner), fan = fans.find(3 * row + corner);
      if (fan_of_vertex[vertex] < 0) fan_of_vertex[vertex] = fan;
      if (fan_of_vertex[vertex] != fan) is_bad[vertex] = true;
    }
  for (int vertex = 0; vertex < surface.points.rows(); ++vertex)
    if (is_bad[vertex]) {
      ++result.n_nonmanifold_vertices;
      list(result.nonmanifold_vertices, vertex);
    }
}

/// Of a solid.
int n_inverted_components(const Triangles& surface) {
  const std::vector<Shell> shells = shell_hierarchy(surface).shells;
  return static_cast<int>(std::count_if(shells.begin(), shells.end(), [](const Shell& shell) {
    // What encloses nothing, such as a triangle whose corners are one point, has no side.
    return shell.volume_mm3 != 0 && shell.is_outward != (shell.depth % 2 == 0);
  }));
}

void check_geometry(const Triangles& surface, Verification& result) {
  const auto degenerate = degenerate_triangles(surface);
  const auto intersections = self_intersections(surface);
  result.n_degenerate = static_cast<int>(degenerate.size());
  result.n_self_intersections = static_cast<int>(intersections.size());
  for (const int row : degenerate) list(result.degenerate, row);
  for (const auto& pair : intersections) list(result.self_intersections, pair);
  result.min_angle_deg = quality(surface).min_angle_deg;
}

std::string plural(int n, std::string_view noun) {
  return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s");
}

}  // namespace

Verification verify(const Triangles& surface) {
  Verification result;
  result.n_triangles = static_cast<int>(surface.elements.rows());
  result.n_invalid = n_invalid_triangles(surface);
  if (result.n_triangles == 0 || result.n_invalid > 0) return result;

  const std::vector<EdgeUse> uses = edge_uses(surface.elements);
  const Components parts = components(uses, surface.elements.rows());
  result.n_components = parts.n;
  check_edges(uses, result);
  check_vertices(surface, uses, result);
  check_geometry(surface, result);
  result.closed = result.n_border_edges == 0;
  result.manifold = result.n_nonmanifold_edges == 0 && result.n_nonmanifold_vertices == 0;
  if (result.is_solid()) {
    result.n_inverted_components = n_inverted_components(surface);
    result.outward = result.n_nonmanifold_edges == 0 && result.n_inverted_components == 0;
  }
  return result;
}

bool Verification::passed() const {
  return closed && manifold && outward && n_degenerate == 0 && n_self_intersections == 0 &&
         n_invalid == 0;
}

std::string Verification::message() const {
  if (n_triangles == 0) return "no triangles";
  if (n_invalid > 0) return plural(n_invalid, "triangle") + " with a missing or non-finite point";
  if (passed())
    return fmt::format("closed, manifold, outward, free of self-intersections; {}, {}",
                       plural(n_triangles, "triangle"), plural(n_components, "component"));
  std::string text;
  const auto add = [&](int n, std::string_view noun, const std::string& first) {
    if (n == 0) return;
    if (!text.empty()) text += ", ";
    text += plural(n, noun);
    if (!first.empty()) text += fmt::format(" (first: {})", first);
  };
  const auto pair = [](std::string_view what, const auto& listed) {
    if (listed.empty()) return std::string();
    return fmt::format("{} {} and {}", what, listed[0].first, listed[0].second);
  };
  const auto single = [](std::string_view what, const auto& listed) {
    return listed.empty() ? std::string() : fmt::format("{} {}", what, listed[0]);
  };
  add(n_border_edges, "border edge", pair("vertices", border_edges));
  add(n_nonmanifold_edges, "non-manifold edge", pair("vertices", nonmanifold_edges));
  add(n_nonmanifold_vertices,
      n_nonmanifold_vertices == 1 ? "non-manifold vertex" : "non-manifold vertice",
      single("vertex", nonmanifold_vertices));
  add(n_misoriented_edges, "edge between differently oriented triangle", "");
  add(n_inverted_components, "component with normals the wrong way", "");
  add(n_degenerate, "degenerate triangle", single("triangle", degenerate));
  add(n_self_intersections, "pair of intersecting triangle", pair("triangles", self_intersections));
  return text;
}

}  // namespace surf::mesh
