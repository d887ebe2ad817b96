#include "libsurf/mesh/adaptivity.h"

#include <Eigen/Geometry>
#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/detail/known_errors.h"
#include "libsurf/mesh/shape_part.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

using fem::Mark;

constexpr double kLargestTurn = 60;  // degrees, of a face when a bisection is undone

/// The mark of a face; bisection hands it on to both children, coarsening back to the parent.
class FaceMarks {
 public:
  FaceMarks(TriMesh& mesh, const std::vector<Mark>& marks) : mesh_(mesh), mark_(mesh) {
    for (int j = 0; j < static_cast<int>(marks.size()); ++j) mark_[FaceHandle(j)] = marks[j];
  }

  /// Takes the marks for refinement from faces that do not carry one now.
  void withdraw_refinement(const std::vector<Mark>& now) {
    for (int j = 0; j < static_cast<int>(now.size()); ++j) {
      Mark& mark = mark_[FaceHandle(j)];
      if (mark == Mark::kRefine && now[j] != Mark::kRefine) mark = Mark::kKeep;
    }
  }

  std::vector<FaceHandle> faces(Mark mark) const {
    std::vector<FaceHandle> out;
    for (int j = 0; j < static_cast<int>(mesh_.n_faces()); ++j)
      if (mark_[FaceHandle(j)] == mark) out.emplace_back(j);
    return out;
  }

  std::vector<char> flags(Mark mark) const {
    std::vector<char> out(mesh_.n_faces());
    for (int j = 0; j < static_cast<int>(out.size()); ++j) out[j] = mark_[FaceHandle(j)] == mark;
    return out;
  }

 private:
  TriMesh& mesh_;
  OpenMesh::FProp<Mark> mark_;
};

/// One call of adapt().
class Adaptation {
 public:
  Adaptation(TriMesh& mesh, const AdaptivityOptions& options)
      : mesh_(mesh), options_(options), errors_(mesh, options.integrands) {}

  AdaptivityReport run(int max_rounds, const std::stop_token& stop) {
    report_.may_coarsen.assign(mesh_.n_faces(), 0);
    for (; report_.n_rounds < max_rounds && !stop.stop_requested(); ++report_.n_rounds) {
      FaceMarks marks(mesh_, marks_now());
      const int n_changes = refine(marks) + coarsen(marks);
      report_.may_coarsen = marks.flags(Mark::kCoarsen);
      if (n_changes > 0) continue;
      report_.is_settled = true;
      break;
    }
    return report_;
  }

 private:
  std::vector<Mark> marks_of(const fem::Geometry<3>& shape, const std::vector<int>& faces) {
    if (options_.integral_tolerance == 0) return adaptivity_marks(shape, options_);
    return adaptivity_marks(shape, options_, errors_(shape, faces));
  }

  /// Of what does not rest, with its neighbours, whose turn the indicators look at.
  std::vector<Mark> marks_now() {
    const Triangles all = to_triangles(mesh_);
    if (!options_.rests) return marks_of(fem::Geometry<3>(all.points, all.elements), {});
    std::vector<char> rests;
    for (const auto& t : all.elements.rowwise())
      rests.push_back(options_.rests(all.points(t, Eigen::all)));
    const ShapePart<3> part =
        part_of<3>(all, without_neighbours<3>(all.elements, std::move(rests)));
    std::vector<Mark> marks(mesh_.n_faces(), Mark::kKeep);
    if (part.elements.empty()) return marks;
    const std::vector<Mark> of_part =
        marks_of(fem::Geometry<3>(part.shape.points, part.shape.elements), part.elements);
    for (std::size_t n = 0; n < of_part.size(); ++n)
      marks[std::size_t(part.elements[n])] = of_part[n];
    return marks;
  }

  double longest_edge(FaceHandle face) const {
    double longest = 0;
    for (const HalfedgeHandle h : mesh_.fh_range(face))
      longest = std::max(longest, mesh_.calc_edge_vector(h).norm());
    return longest;
  }

  /// d - 1 bisections, the second where the children still ask for it.
  int refine(FaceMarks& marks) {
    int n_new = 0;
    for (int pass = 0; pass < 2; ++pass) {
      if (pass > 0 && n_new > 0) marks.withdraw_refinement(marks_now());
      std::vector<FaceHandle> faces = marks.faces(Mark::kRefine);
      std::erase_if(faces,
                    [&](FaceHandle face) { return longest_edge(face) <= options_.min_length_mm; });
      if (static_cast<Eigen::Index>(mesh_.n_faces() + 2 * faces.size()) > options_.max_elements) {
        report_.is_limited |= !faces.empty();
        break;
      }
      n_new += bisect(mesh_, faces);
    }
    report_.n_refined += n_new;
    return n_new;
  }

  int coarsen(const FaceMarks& marks) {
    int n_removed = 0;
    for (int pass = 0; pass < 2; ++pass)
      n_removed += mesh::coarsen(mesh_, marks.faces(Mark::kCoarsen),
                                 [this](VertexHandle vertex) { return may_remove(vertex); });
    report_.n_coarsened += n_removed;
    return n_removed;
  }

  /// Whether the two faces that come back when the bisection of `vertex` is undone stay within what
  /// would be refined again.
  bool may_remove(VertexHandle vertex) const {
    const auto [a, b] = bisected_edge(mesh_, vertex);
    // Neighbours in counter-clockwise order, from a on: a, c, b, d.
    std::vector<VertexHandle> ring;
    std::vector<HalfedgeHandle> rim;  // rim[k] from ring[k] to ring[k + 1]
    for (const HalfedgeHandle spoke : mesh_.voh_ccw_range(vertex)) {
      ring.push_back(mesh_.to_vertex_handle(spoke));
      rim.push_back(mesh_.next_halfedge_handle(spoke));
    }
    const auto first = std::find(ring.begin(), ring.end(), a) - ring.begin();
    std::rotate(rim.begin(), rim.begin() + first, rim.end());
    std::rotate(ring.begin(), ring.begin() + first, ring.end());
    const Eigen::Vector3d A = mesh_.point(a), B = mesh_.point(b), C = mesh_.point(ring[1]),
                          D = mesh_.point(ring[3]);
    const double length = (B - A).norm();
    if (length > options_.max_length_mm) return false;
    const Eigen::Vector3d left = (C - A).cross(B - A), right = (B - A).cross(D - A);
    const double turn = kLargestTurn * std::numbers::pi / 180;
    if (!(left.squaredNorm() > 0 && right.squaredNorm() > 0)) return false;
    for (int k = 0; k < 4; ++k)
      if (angle_between(normal(rim[k]), k < 2 ? left : right) > turn) return false;
    if (options_.geometry_tolerance_mm == 0) return true;
    const double between = length * angle_between(left, right);
    const double eta_left = between + side(rim[0], left) + side(rim[1], left);
    const double eta_right = between + side(rim[2], right) + side(rim[3], right);
    return std::max(eta_left, eta_right) <= options_.gamma_refine * options_.geometry_tolerance_mm;
  }

  /// Of the face of a half-edge, not normalised.
  Eigen::Vector3d normal(HalfedgeHandle halfedge) const {
    const HalfedgeHandle next = mesh_.next_halfedge_handle(halfedge);
    return area_normal(mesh_.point(mesh_.from_vertex_handle(halfedge)),
                       mesh_.point(mesh_.to_vertex_handle(halfedge)),
                       mesh_.point(mesh_.to_vertex_handle(next)));
  }

  /// h_S theta_S of the edge of a half-edge whose face would have this normal.
  double side(HalfedgeHandle halfedge, const Eigen::Vector3d& of_face) const {
    const HalfedgeHandle other = mesh_.opposite_halfedge_handle(halfedge);
    return mesh_.calc_edge_length(other) * angle_between(of_face, normal(other));
  }

  TriMesh& mesh_;
  const AdaptivityOptions& options_;
  KnownErrors errors_;
  AdaptivityReport report_;
};

}  // namespace

AdaptivityReport adapt(TriMesh& mesh, const AdaptivityOptions& options, int max_rounds,
                       const std::stop_token& stop) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  return Adaptation(mesh, options).run(max_rounds, stop);
}

}  // namespace surf::mesh
