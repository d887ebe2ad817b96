#include "libsurf/mesh/clip.h"

#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/boost/graph/generators.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/detail/corefined.h"
#include "libsurf/mesh/verify.h"

namespace surf::mesh {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Mesh = CutMesh;

// Cells: vertices as near to a face as this are put on it, or the cut would leave triangles as
// thin.
constexpr double kSnap = 1e-3;
// What two cuts may still leave beside each other: angles above 179 degrees, or one side this many
// times longer than another of at most kSnap cells.
const double kCap = std::cos(179 * CGAL_PI / 180);
constexpr double kNeedle = 100;

/// In indices of the box, where its faces are axis-parallel.
/// @param snap  how near to a face a vertex is put on it [cells]
Mesh to_cgal(const Triangles& surface, const ImageBox<3>& box, double snap) {
  Mesh mesh;
  const auto first = box.first(), last = box.last();
  for (const auto& point : surface.points.rowwise()) {
    auto at = box.index(point.transpose());
    for (int axis = 0; axis < 3; ++axis)
      for (const double face : {first[axis], last[axis]})
        if (std::abs(at[axis] - face) <= snap) at[axis] = face;
    mesh.add_vertex({at[0], at[1], at[2]});
  }
  const bool is_mirrored = box.index_to_world.linear().determinant() < 0;
  for (const auto& t : surface.elements.rowwise()) {
    const Mesh::Vertex_index a(t[0]), b(t[1]), c(t[2]);
    if (mesh.add_face(a, is_mirrored ? c : b, is_mirrored ? b : c) == Mesh::null_face())
      throw InvalidMesh("a surface that reaches out of the volume is not manifold");
  }
  if (!CGAL::is_closed(mesh)) throw InvalidMesh("a surface that reaches out of the volume is open");
  return mesh;
}

/// @param from  whose vertices keep their places to the bit, where no cut has moved them
Triangles from_cgal(Mesh mesh, const ImageBox<3>& box, const Triangles& from) {
  std::map<std::array<double, 3>, Eigen::Index> kept;
  for (Eigen::Index i = 0; i < from.points.rows(); ++i) {
    const auto at = box.index(from.points.row(i).transpose());
    kept.insert({{at[0], at[1], at[2]}, i});
  }
  mesh.collect_garbage();
  Triangles out{Points<3>(mesh.number_of_vertices(), 3), Elements<3>(mesh.number_of_faces(), 3)};
  for (const auto vertex : mesh.vertices()) {
    const auto& p = mesh.point(vertex);
    const auto same = kept.find({p.x(), p.y(), p.z()});
    const Vector<3> world = same != kept.end()
                                ? Vector<3>(from.points.row(same->second).transpose())
                                : box.index_to_world * Vector<3>(p.x(), p.y(), p.z());
    out.points.row(Eigen::Index(vertex)) = box.clamped(world, box.faces(world)).transpose();
  }
  const bool is_mirrored = box.index_to_world.linear().determinant() < 0;
  Eigen::Index row = 0;
  for (const auto face : mesh.faces()) {
    int column = 0;
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face)))
      out.elements(row, column++) = int(Eigen::Index(vertex));
    if (is_mirrored) std::swap(out.elements(row, 1), out.elements(row, 2));
    ++row;
  }
  return out;
}

Mesh cuboid(const ImageBox<3>& box) {
  const auto first = box.first(), last = box.last();
  const CutKernel::Iso_cuboid_3 of({first[0], first[1], first[2]}, {last[0], last[1], last[2]});
  Mesh out;
  CGAL::make_hexahedron(of[0], of[1], of[2], of[3], of[4], of[5], of[6], of[7], out);
  PMP::triangulate_faces(out);
  return out;
}

/// What of the surface lies in the box, closed along its faces; nothing if that has no clear
/// answer.
std::optional<Mesh> cut(const Triangles& surface, const ImageBox<3>& box, double snap) {
  Mesh mesh = to_cgal(surface, box, snap), cells = cuboid(box);
  try {
    if (!intersect(mesh, cells, mesh)) return std::nullopt;
  } catch (const InvalidMesh&) {
    return std::nullopt;
  }
  // Where there are faces without any area the other leaves some of them.
  if (!PMP::remove_degenerate_faces(mesh)) return std::nullopt;
  PMP::experimental::remove_almost_degenerate_faces(mesh, kCap, kNeedle, kSnap);
  return mesh;
}

}  // namespace

Triangles clipped(const Triangles& surface, const ImageBox<3>& box) {
  const auto rows = surface.points.rowwise();
  // What has been clipped lies on the faces to rounding only, and is not cut again.
  if (std::none_of(rows.begin(), rows.end(),
                   [&](const auto& point) { return box.is_beyond(point.transpose()); }))
    return surface;
  // A surface that winds about a face may come to touch itself there; not so where it is put on it.
  std::optional<Triangles> best;
  for (const double snap : {kSnap, 0.0, 4 * kSnap, 16 * kSnap}) {
    std::optional<Mesh> mesh = cut(surface, box, snap);
    if (!mesh) continue;
    if (mesh->number_of_faces() == 0 && !best)
      throw InvalidMesh("nothing of the surface lies in the volume");
    if (mesh->number_of_faces() == 0) break;
    Triangles out = from_cgal(*std::move(mesh), box, surface);
    if (verify(out).passed()) return out;
    if (!best) best = std::move(out);
  }
  if (!best) throw InvalidMesh("a surface that reaches out of the volume cannot be clipped");
  return *std::move(best);
}

}  // namespace surf::mesh
