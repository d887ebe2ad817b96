#include "libsurf/mesh/detail/mending.h"

#include <algorithm>

namespace surf::mesh {

using Eigen::Vector3d;

namespace {

/// Adjacent faces have corners and midpoints in common: what is among the last ones is left out.
void add_new(const Vector3d& witness, std::vector<Vector3d>& witnesses) {
  constexpr std::size_t kLast = 64;
  const auto first = witnesses.end() - std::ptrdiff_t(std::min(witnesses.size(), kLast));
  if (std::find(first, witnesses.end(), witness) == witnesses.end()) witnesses.push_back(witness);
}

}  // namespace

Mending::Mending(TriMesh& mesh_now, const ImproveOptions& options_now)
    : mesh(mesh_now),
      options(options_now),
      is_reconnected(mesh_now.n_faces(), false),
      changed_(mesh_now.n_vertices(), 0),
      witnesses_(mesh_now.n_faces()) {}

bool Mending::is_on_border(FaceHandle face) const {
  std::uint8_t common = 0xff;
  for (const VertexHandle corner : mesh.fv_range(face)) common &= options.box->faces(point(corner));
  return common != 0;
}

bool Mending::ends_on_border(VertexHandle vertex) const {
  if (!options.box || options.box->faces(point(vertex)) == 0) return false;
  bool is_on = false, is_off = false;
  for (const FaceHandle face : mesh.vf_range(vertex)) (is_on_border(face) ? is_on : is_off) = true;
  return is_on && is_off;
}

void Mending::keep_on_border(VertexHandle a, VertexHandle b, std::vector<Vector3d>& places) const {
  if (!options.box) return;
  const bool a_ends = ends_on_border(a), b_ends = ends_on_border(b);
  if (a_ends != b_ends) places = {point(a_ends ? a : b)};
  const std::uint8_t faces = options.box->faces(point(a)) | options.box->faces(point(b));
  for (Vector3d& place : places) place = options.box->clamped(place, faces);
}

Diamond Mending::diamond(EdgeHandle edge) const {
  const HalfedgeHandle h = mesh.halfedge_handle(edge, 0), o = mesh.halfedge_handle(edge, 1);
  return {h,
          o,
          mesh.from_vertex_handle(h),
          mesh.to_vertex_handle(h),
          mesh.to_vertex_handle(mesh.next_halfedge_handle(h)),
          mesh.to_vertex_handle(mesh.next_halfedge_handle(o))};
}

void Mending::add_witnesses(FaceHandle face, std::vector<Vector3d>& witnesses) const {
  const auto& list = witnesses_[face.idx()];
  if (list.has_value()) {
    for (const Vector3d& witness : *list) add_new(witness, witnesses);
    return;
  }
  for (const HalfedgeHandle h : mesh.fh_range(face)) {
    const Vector3d &from = point(mesh.from_vertex_handle(h)), &to = point(mesh.to_vertex_handle(h));
    add_new(from, witnesses);
    add_new(0.5 * (from + to), witnesses);
  }
}

bool Mending::are_witnesses_near(const std::vector<Vector3d>& witnesses,
                                 const std::vector<Corners>& patch) const {
  const NearPatch near(patch);
  return std::all_of(witnesses.begin(), witnesses.end(), [&](const Vector3d& witness) {
    return near.is_near(witness, options.tolerance_mm);
  });
}

void Mending::hand_over(const std::vector<Vector3d>& witnesses,
                        const std::vector<std::size_t>& keepers,
                        const std::vector<FaceHandle>& faces) {
  for (const FaceHandle face : faces) witnesses_[face.idx()].emplace();
  for (std::size_t n = 0; n < witnesses.size(); ++n)
    witnesses_[faces[keepers[n]].idx()]->push_back(witnesses[n]);
}

void Mending::note_change_at(VertexHandle vertex) {
  changed_[std::size_t(vertex.idx())] = ++n_changes_;
  for (const VertexHandle neighbour : mesh.vv_range(vertex))
    changed_[std::size_t(neighbour.idx())] = n_changes_;
}

bool Mending::has_changed_round(VertexHandle vertex, int n_changes) const {
  if (last_change_at(vertex) > n_changes) return true;
  for (const VertexHandle neighbour : mesh.vv_range(vertex))
    if (last_change_at(neighbour) > n_changes) return true;
  return false;
}

}  // namespace surf::mesh
