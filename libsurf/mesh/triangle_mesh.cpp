#include "libsurf/mesh/triangle_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"

namespace surf::mesh {
namespace {

/// Side `corner` -> `corner + 1` of a triangle.
struct Side {
  std::uint64_t vertices;  // smaller index in the upper half, larger in the lower: sorts as a pair
  int triangle;
  std::uint8_t corner;
  bool is_forward;  // runs from the smaller to the larger index

  int low() const { return static_cast<int>(vertices >> 32); }
  int high() const { return static_cast<int>(vertices & 0xffffffffu); }
};

/// Where a closed surface's sides meet: sides 2e and 2e + 1 belong to edge e, the first runs
/// forward.
using Sides = std::vector<Side>;

void check_points(const Points<3>& points) {
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (!points.row(i).allFinite())
      throw InvalidMesh(fmt::format("surface: vertex {} has a coordinate that is NaN or Inf", i));
}

void check_indices(const Triangles& surface) {
  const auto n = static_cast<int>(surface.points.rows());
  for (Eigen::Index j = 0; j < surface.elements.rows(); ++j) {
    const auto row = surface.elements.row(j);
    for (int corner = 0; corner < 3; ++corner)
      if (row[corner] < 0 || row[corner] >= n)
        throw InvalidMesh(fmt::format("surface: triangle {} names vertex {}, but there are {}", j,
                                      row[corner], n));
    if (row[0] == row[1] || row[1] == row[2] || row[2] == row[0])
      throw InvalidMesh(fmt::format("surface: triangle {} ({}, {}, {}) names a vertex twice", j,
                                    row[0], row[1], row[2]));
  }
}

/// Sorted by edge and direction in two counting passes (by high, then stably by low vertex),
/// so linear in time.
Sides sorted_sides(const Triangles& surface) {
  Sides sides;
  sides.reserve(3 * surface.elements.rows());
  for (int j = 0; j < surface.elements.rows(); ++j)
    for (std::uint8_t corner = 0; corner < 3; ++corner) {
      const int from = surface.elements(j, corner), to = surface.elements(j, (corner + 1) % 3);
      const std::uint64_t low = std::min(from, to), high = std::max(from, to);
      sides.push_back({low << 32 | high, j, corner, from < to});
    }
  Sides other(sides.size());
  const auto sort_by = [&](auto key, std::size_t n_keys) {
    std::vector<std::size_t> begin(n_keys + 1, 0);
    for (const Side& side : sides) ++begin[key(side) + 1];
    for (std::size_t k = 1; k < begin.size(); ++k) begin[k] += begin[k - 1];
    for (const Side& side : sides) other[begin[key(side)]++] = side;
    sides.swap(other);
  };
  sort_by([](const Side& side) { return side.is_forward ? 0 : 1; }, 2);
  sort_by([](const Side& side) { return side.high(); }, surface.points.rows());
  sort_by([](const Side& side) { return side.low(); }, surface.points.rows());
  return sides;
}

void check_edge(const Sides& sides, std::size_t first, std::size_t last) {
  const Side& side = sides[first];
  const auto edge =
      fmt::format("surface: edge ({}, {}) of triangle {}", side.low(), side.high(), side.triangle);
  if (last - first == 1)
    throw InvalidMesh(edge + " has no other triangle: the surface is open; close its holes first");
  if (last - first > 2)
    throw InvalidMesh(
        fmt::format("{} has {} triangles: the surface is not a 2-manifold", edge, last - first));
  throw InvalidMesh(
      fmt::format("{} runs the same way in triangle {}: the surface is not consistently oriented",
                  edge, sides[first + 1].triangle));
}

void check_edges(const Sides& sides) {
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
    while (last < sides.size() && sides[last].vertices == sides[first].vertices) ++last;
    if (last - first != 2 || sides[first].is_forward == sides[first + 1].is_forward)
      check_edge(sides, first, last);
  }
}

HalfedgeHandle halfedge_of(std::size_t side) { return HalfedgeHandle(static_cast<int>(side)); }

/// Side k becomes half-edge k, so edge e has the sides 2e and 2e + 1.
TriMesh connect(const Triangles& surface, const Sides& sides) {
  const Eigen::Index n_vertices = surface.points.rows(), n_faces = surface.elements.rows();
  TriMesh mesh;
  mesh.resize(n_vertices, sides.size() / 2, n_faces);
  for (int i = 0; i < n_vertices; ++i)
    mesh.set_point(VertexHandle(i), surface.points.row(i).transpose());

  std::vector<std::array<HalfedgeHandle, 3>> halfedges(n_faces);
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const Side& side = sides[k];
    halfedges[side.triangle][side.corner] = halfedge_of(k);
    mesh.set_vertex_handle(halfedge_of(k),
                           VertexHandle(side.is_forward ? side.high() : side.low()));
    mesh.set_face_handle(halfedge_of(k), FaceHandle(side.triangle));
  }
  for (int j = 0; j < n_faces; ++j) {
    for (int corner = 0; corner < 3; ++corner) {
      mesh.set_next_halfedge_handle(halfedges[j][corner], halfedges[j][(corner + 1) % 3]);
      mesh.set_halfedge_handle(VertexHandle(surface.elements(j, corner)), halfedges[j][corner]);
    }
    mesh.set_halfedge_handle(FaceHandle(j), halfedges[j][0]);
  }
  return mesh;
}

/// Every triangle of a vertex must be met on one way round it.
void check_fans(const TriMesh& mesh) {
  std::vector<int> n_triangles(mesh.n_vertices(), 0);
  for (std::size_t h = 0; h < mesh.n_halfedges(); ++h)
    ++n_triangles[mesh.to_vertex_handle(halfedge_of(h)).idx()];
  for (int i = 0; i < static_cast<int>(mesh.n_vertices()); ++i) {
    const HalfedgeHandle start = mesh.halfedge_handle(VertexHandle(i));
    if (n_triangles[i] == 0 || !start.is_valid())
      throw InvalidMesh(fmt::format("surface: vertex {} is in no triangle", i));
    int n_in_fan = 0;
    HalfedgeHandle halfedge = start;
    do {
      ++n_in_fan;
      halfedge = mesh.next_halfedge_handle(mesh.opposite_halfedge_handle(halfedge));
    } while (halfedge != start && n_in_fan <= n_triangles[i]);
    if (n_in_fan != n_triangles[i])
      throw InvalidMesh(fmt::format(
          "surface: the {} triangles of vertex {} are not one fan: the surface is not a 2-manifold",
          n_triangles[i], i));
    if (n_in_fan < 3)
      throw InvalidMesh(fmt::format("surface: vertex {} has only {} triangles", i, n_in_fan));
  }
}

void check_halfedges(const TriMesh& mesh) {
  for (const auto h : mesh.halfedges()) {
    const HalfedgeHandle next = mesh.next_halfedge_handle(h);
    const FaceHandle face = mesh.face_handle(h);
    if (!next.is_valid() || !face.is_valid() || !mesh.to_vertex_handle(h).is_valid())
      throw InvalidMesh(fmt::format("mesh: half-edge {} has no face, next or vertex", h.idx()));
    const HalfedgeHandle after = mesh.next_halfedge_handle(next);
    if (mesh.next_halfedge_handle(after) != h || mesh.prev_halfedge_handle(next) != h ||
        mesh.face_handle(next) != face || mesh.from_vertex_handle(next) != mesh.to_vertex_handle(h))
      throw InvalidMesh(fmt::format("mesh: half-edge {} is not one of a triangle", h.idx()));
  }
  for (const auto f : mesh.faces())
    if (mesh.face_handle(mesh.halfedge_handle(f)) != f)
      throw InvalidMesh(fmt::format("mesh: face {} has a half-edge of another face", f.idx()));
  for (const auto v : mesh.vertices())
    if (!mesh.halfedge_handle(v).is_valid() ||
        mesh.from_vertex_handle(mesh.halfedge_handle(v)) != v)
      throw InvalidMesh(
          fmt::format("mesh: vertex {} has a half-edge that starts elsewhere", v.idx()));
}

void check_no_garbage(const TriMesh& mesh) {
  const auto is_deleted = [&](auto handle) { return mesh.status(handle).deleted(); };
  if (std::any_of(mesh.vertices_begin(), mesh.vertices_end(), is_deleted) ||
      std::any_of(mesh.edges_begin(), mesh.edges_end(), is_deleted) ||
      std::any_of(mesh.faces_begin(), mesh.faces_end(), is_deleted))
    throw InvalidMesh("mesh: it holds deleted elements; collect the garbage first");
}

}  // namespace

TriMesh to_mesh(const Triangles& surface) {
  check_points(surface.points);
  check_indices(surface);
  const Sides sides = sorted_sides(surface);
  check_edges(sides);
  TriMesh mesh = connect(surface, sides);
  check_fans(mesh);
  return mesh;
}

Triangles to_triangles(const TriMesh& mesh) { return {points(mesh), elements(mesh)}; }

Points<3> points(const TriMesh& mesh) {
  const auto n = static_cast<int>(mesh.n_vertices());
  Points<3> result(n, 3);
  for (int i = 0; i < n; ++i) result.row(i) = mesh.point(VertexHandle(i)).transpose();
  return result;
}

Elements<3> elements(const TriMesh& mesh) {
  const auto n = static_cast<int>(mesh.n_faces());
  Elements<3> result(n, 3);
  for (int j = 0; j < n; ++j) {
    assert(!mesh.status(FaceHandle(j)).deleted() && "collect the garbage before taking arrays");
    const HalfedgeHandle first = mesh.halfedge_handle(FaceHandle(j));
    const HalfedgeHandle second = mesh.next_halfedge_handle(first);
    result(j, 0) = mesh.from_vertex_handle(first).idx();
    result(j, 1) = mesh.to_vertex_handle(first).idx();
    result(j, 2) = mesh.to_vertex_handle(second).idx();
  }
  return result;
}

void set_points(TriMesh& mesh, const Points<3>& points) {
  assert(points.rows() == static_cast<Eigen::Index>(mesh.n_vertices()));
  for (int i = 0; i < points.rows(); ++i)
    mesh.set_point(VertexHandle(i), points.row(i).transpose());
}

void check_mesh(const TriMesh& mesh) {
  check_no_garbage(mesh);
  check_halfedges(mesh);
  const Triangles surface = to_triangles(mesh);
  check_points(surface.points);
  check_indices(surface);
  check_edges(sorted_sides(surface));
  check_fans(mesh);
  check_refinement_edges(mesh);
}

}  // namespace surf::mesh
