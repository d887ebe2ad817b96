#include "libsurf/mesh/difference.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/mesh/detail/corefined.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/improve.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/triangle_mesh.h"
#include "libsurf/mesh/verify.h"

namespace surf::mesh {
namespace {

// Tries: shares of the wanted gap.
constexpr std::array kGaps = {1.0, 0.8, 1.25, 0.6, 1.5, 0.5};
constexpr double kToleranceOfMending = 0.5;  // of the gap
constexpr double kShortEdge = 0.1;           // of the mean edge: collapsed along the cut
constexpr int kRingsAtCut = 2;

CutMesh to_cgal(const Triangles& surface) {
  CutMesh out;
  for (const auto& x : surface.points.rowwise()) out.add_vertex({x[0], x[1], x[2]});
  for (const auto& t : surface.elements.rowwise())
    out.add_face(CutMesh::Vertex_index(t[0]), CutMesh::Vertex_index(t[1]),
                 CutMesh::Vertex_index(t[2]));
  return out;
}

Triangles to_triangles(CutMesh& mesh) {
  mesh.collect_garbage();
  Triangles out;
  out.points.resize(Eigen::Index(mesh.number_of_vertices()), 3);
  out.elements.resize(Eigen::Index(mesh.number_of_faces()), 3);
  for (const auto v : mesh.vertices())
    for (int axis = 0; axis < 3; ++axis) out.points(Eigen::Index(v), axis) = mesh.point(v)[axis];
  for (const auto f : mesh.faces()) {
    int corner = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
      out.elements(Eigen::Index(f), corner++) = int(v);
  }
  return out;
}

using Place = std::array<double, 3>;
Place place_of(const Points<3>& points, Eigen::Index i) {
  return {points(i, 0), points(i, 1), points(i, 2)};
}

/// One flag per vertex: it is none of these surfaces'.
std::vector<char> are_new(const Triangles& cut, const Triangles& first, const Triangles& second) {
  std::set<Place> known;
  for (const Triangles* surface : {&first, &second})
    for (Eigen::Index i = 0; i < surface->points.rows(); ++i)
      known.insert(place_of(surface->points, i));
  std::vector<char> out(cut.points.rows());
  for (Eigen::Index i = 0; i < cut.points.rows(); ++i)
    out[i] = !known.contains(place_of(cut.points, i));
  return out;
}

/// Faces within some rings of the flagged vertices.
std::vector<char> faces_near(const Triangles& surface, std::vector<char> is_flagged, int n_rings) {
  std::vector<char> out(surface.elements.rows());
  for (int ring = 0; ring < n_rings; ++ring) {
    for (Eigen::Index t = 0; t < surface.elements.rows(); ++t)
      for (const int v : surface.elements.row(t)) out[t] |= is_flagged[v];
    for (Eigen::Index t = 0; t < surface.elements.rows(); ++t)
      if (out[t])
        for (const int v : surface.elements.row(t)) is_flagged[v] = 1;
  }
  return out;
}

/// The triangles along the cut, better shaped within the tolerance.
Triangles mended(const Triangles& cut, const std::vector<char>& is_new, double tolerance_mm) {
  const Quality quality = mesh::quality(cut);
  ImproveOptions options;
  options.min_length = kShortEdge * quality.mean_edge_mm;
  options.max_length = quality.max_edge_mm;
  options.tolerance_mm = tolerance_mm;
  options.frozen = faces_near(cut, is_new, kRingsAtCut);
  for (char& flag : options.frozen) flag = !flag;
  TriMesh mesh = to_mesh(cut);
  improve(mesh, options);
  return mesh::to_triangles(mesh);
}

/// Pieces at the cut that are too small or too thin go; those that were there before stay.
void remove_crumbs(const Triangles& before, const PartOptions<3>& options, Parted<3>& out) {
  const ShellHierarchy hierarchy = shell_hierarchy(out.shape);
  std::set<Place> known;
  for (Eigen::Index i = 0; i < before.points.rows(); ++i) known.insert(place_of(before.points, i));
  std::vector<char> is_cut(hierarchy.shells.size()), goes(hierarchy.shells.size());
  for (Eigen::Index t = 0; t < out.shape.elements.rows(); ++t)
    for (const int v : out.shape.elements.row(t))
      if (!known.contains(place_of(out.shape.points, v))) is_cut[hierarchy.of_triangle[t]] = 1;
  for (const Solid& solid : solids(hierarchy)) {
    if (!is_cut[solid.outer]) continue;
    const double volume = hierarchy.shells[solid.outer].volume_mm3;
    const double thickness = 2 * solid.volume_mm3 / solid.area_mm2;
    if (volume >= options.min_content && thickness >= options.min_thickness_mm) continue;
    goes[solid.outer] = 1;
    for (const int cavity : solid.cavities) goes[cavity] = 1;
    ++out.n_crumbs;
    out.crumbs += solid.volume_mm3;
  }
  if (out.n_crumbs == 0) return;
  Triangles rest{out.shape.points, Elements<3>(out.shape.elements.rows(), 3)};
  Eigen::Index n = 0;
  for (Eigen::Index t = 0; t < out.shape.elements.rows(); ++t)
    if (!goes[hierarchy.of_triangle[t]]) rest.elements.row(n++) = out.shape.elements.row(t);
  rest.elements.conservativeResize(n, 3);
  out.shape = n == 0 ? Triangles{} : filtered(rest).surface;  // without the unused points
}

/// One try; nothing if it fails.
std::optional<Parted<3>> attempt(const Triangles& surface, const Triangles& other, double gap_mm,
                                 bool mends, const PartOptions<3>& options) {
  // Where the wall intersects itself apart from the surface, it does not matter; else the checks
  // below fail.
  const Triangles wall = moved_along_normals(other, gap_mm);
  Parted<3> out;
  out.has_changed = true;
  try {
    out.shape = difference(surface, wall);
  } catch (const InvalidMesh&) {
    return std::nullopt;
  }
  const auto finished = [&] {
    if (out.shape.elements.rows() > 0) {
      if (options.rounded) out.shape = options.rounded(out.shape);
      if (!verify(out.shape).passed() || do_overlap(out.shape, other)) return false;
    }
    out.removed = volume_mm3(surface) - volume_mm3(out.shape);
    return true;
  };
  if (out.shape.elements.rows() == 0) return finished() ? std::optional(out) : std::nullopt;
  try {
    if (mends)
      out.shape =
          mended(out.shape, are_new(out.shape, surface, wall), kToleranceOfMending * gap_mm);
    if (!verify(out.shape).passed()) return std::nullopt;
  } catch (const InvalidMesh&) {
    return std::nullopt;
  }
  remove_crumbs(surface, options, out);
  return finished() ? std::optional(out) : std::nullopt;
}

bool has_point_inside(const Triangles& points_of, const Triangles& solid) {
  const ShellHierarchy hierarchy = shell_hierarchy(points_of);
  Points<3> one_each(Eigen::Index(hierarchy.shells.size()), 3);
  for (Eigen::Index t = 0; t < points_of.elements.rows(); ++t)
    one_each.row(hierarchy.of_triangle[t]) = points_of.points.row(points_of.elements(t, 0));
  const std::vector<char> is_inside = are_inside<3>(solid, one_each);
  return std::find(is_inside.begin(), is_inside.end(), 1) != is_inside.end();
}

}  // namespace

Triangles moved_along_normals(const Triangles& surface, double distance_mm) {
  Points<3> normals = Points<3>::Zero(surface.points.rows(), 3);
  for (const auto& t : surface.elements.rowwise())
    for (int c = 0; c < 3; ++c) {
      const Vector<3> a = surface.points.row(t[c]), b = surface.points.row(t[(c + 1) % 3]),
                      d = surface.points.row(t[(c + 2) % 3]);
      const Vector<3> cross = (b - a).cross(d - a);
      const double angle = std::atan2(cross.norm(), (b - a).dot(d - a));
      if (cross.norm() > 0) normals.row(t[c]) += angle * cross.normalized();
    }
  Triangles out = surface;
  for (Eigen::Index i = 0; i < normals.rows(); ++i)
    if (normals.row(i).norm() > 0) out.points.row(i) += distance_mm * normals.row(i).normalized();
  return out;
}

Triangles difference(const Triangles& surface, const Triangles& other) {
  CutMesh first = to_cgal(surface), second = to_cgal(other), out;
  bool is_manifold = false;
  try {
    is_manifold = subtract(first, second, out);
  } catch (const std::exception& error) {
    throw InvalidMesh(fmt::format("difference of two surfaces: {}", error.what()));
  }
  if (!is_manifold) throw InvalidMesh("difference of two surfaces: not a manifold");
  return to_triangles(out);
}

bool do_overlap(const Triangles& first, const Triangles& second) {
  const Triangles both = joined({first, second});
  std::vector<char> is_first(both.elements.rows());
  std::fill_n(is_first.begin(), first.elements.rows(), 1);
  for (const auto& [a, b] : self_intersections(both))
    if (is_first[a] != is_first[b]) return true;
  return has_point_inside(first, second) || has_point_inside(second, first);
}

template <int Dim>
std::string PartOptions<Dim>::error() const {
  if (!(gap_mm > 0)) return fmt::format("PartOptions::gap_mm = {} violates > 0", gap_mm);
  if (!(min_content >= 0))
    return fmt::format("PartOptions::min_content = {} violates >= 0", min_content);
  if (!(min_thickness_mm >= 0))
    return fmt::format("PartOptions::min_thickness_mm = {} violates >= 0", min_thickness_mm);
  return {};
}

Parted<3> parted(const Triangles& surface, const Triangles& other, const PartOptions<3>& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  if (surface.elements.rows() == 0 || other.elements.rows() == 0 || !do_overlap(surface, other))
    return {.shape = surface};
  for (const bool mends : {true, false})
    for (const double share : kGaps)
      if (auto out = attempt(surface, other, share * options.gap_mm, mends, options)) return *out;
  throw InvalidMesh("no cut along its wall passes the final check");
}

template struct PartOptions<2>;
template struct PartOptions<3>;

}  // namespace surf::mesh
