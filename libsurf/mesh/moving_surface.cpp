#include "libsurf/mesh/moving_surface.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/improve.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/sheet_guard.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

constexpr int kGuardRounds = 3;
constexpr double kLongest = 4.0 / 3, kShortest = 0.4;      // of the wanted edge length
constexpr int kRoundsAtTheStart = 30, kRoundsInAStep = 2;  // of adaptivity
constexpr double kTolerance = 0.1;  // by which mending may move the surface, likewise

/// Share of the area that belongs to the vertices chosen, a third of each of their triangles.
template <class IsChosen>
double share_of_area(const Points<3>& X, const Elements<3>& T, const IsChosen& is_chosen) {
  double chosen = 0, all = 0;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const Vector<3> a = X.row(T(t, 0)), b = X.row(T(t, 1)), c = X.row(T(t, 2));
    const double area = area_normal(a, b, c).norm();
    all += 3 * area;
    for (int i = 0; i < 3; ++i) chosen += is_chosen(T(t, i)) ? area : 0;
  }
  return all > 0 ? chosen / all : 0;
}

}  // namespace

std::string MovingSurfaceOptions::error() const {
  if (!(edge_length_mm > 0))
    return fmt::format("MovingSurfaceOptions::edge_length_mm = {} violates > 0", edge_length_mm);
  if (!(coarseness >= 1))
    return fmt::format("MovingSurfaceOptions::coarseness = {} violates >= 1", coarseness);
  if (!(max_displacement_mm > 0))
    return fmt::format("MovingSurfaceOptions::max_displacement_mm = {} violates > 0",
                       max_displacement_mm);
  if (!(sheet_distance >= 0))
    return fmt::format("MovingSurfaceOptions::sheet_distance = {} violates >= 0", sheet_distance);
  return {};
}

MovingSurface::MovingSurface(const Triangles& initial, const MovingSurfaceOptions& options)
    : mesh_(to_mesh(initial)), options_(options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  mend(kRoundsAtTheStart);
  // A round collapses once at each place: until few are left.
  for (int round = 0; round < kRoundsAtTheStart; ++round) {
    const auto n_before = mesh_.n_faces();
    mend();
    if (mesh_.n_faces() > 0.99 * double(n_before)) break;
  }
}

fem::Geometry<3> MovingSurface::geometry() const { return {points(mesh_), elements(mesh_)}; }

Triangles MovingSurface::triangles() const { return to_triangles(mesh_); }

void MovingSurface::set_edge_length(double edge_length_mm) {
  options_.max_displacement_mm *= edge_length_mm / options_.edge_length_mm;
  options_.edge_length_mm = edge_length_mm;
}

void MovingSurface::set_integrands(std::vector<std::shared_ptr<const Field<3>>> integrands) {
  options_.adaptivity.integrands = std::move(integrands);
}

void MovingSurface::keep_in_box(Points<3>& to) const {
  if (!options_.box) return;
  const VolumeBox& box = *options_.box;
  const Eigen::Array3d last(box.size[0] - 1, box.size[1] - 1, box.size[2] - 1);
  for (Eigen::Index i = 0; i < to.rows(); ++i) {
    const Eigen::Vector3d index = box.world_to_index * to.row(i).transpose();
    const Eigen::Vector3d inside = index.array().max(0).min(last);
    if (inside == index) continue;
    to.row(i) = box.index_to_world * inside;
  }
}

double MovingSurface::restrict_move(Points<3>& to) {
  keep_in_box(to);
  const Points<3> from = points(mesh_), wanted = to;
  const Elements<3> T = elements(mesh_);
  for (int round = 0; round < kGuardRounds && options_.sheet_distance > 0; ++round) {
    const std::vector<char> touched =
        vertices_in_contact(from, to, T, options_.sheet_distance * options_.edge_length_mm);
    Eigen::Index n_touched = 0;
    for (Eigen::Index i = 0; i < to.rows(); ++i)
      if (touched[i] && to.row(i) != from.row(i)) {
        to.row(i) = from.row(i);
        ++n_touched;
      }
    if (n_touched == 0) break;
  }
  hold_intersecting(from, to, T);
  return share_of_area(
      from, T, [&](int i) { return to.row(i) == from.row(i) && wanted.row(i) != from.row(i); });
}

void MovingSurface::move_to(const Points<3>& to) { set_points(mesh_, to); }

AdaptivityOptions MovingSurface::adaptivity() const {
  AdaptivityOptions out = options_.adaptivity;
  out.min_length_mm = kLongest * options_.edge_length_mm;
  out.max_length_mm = options_.coarseness * out.min_length_mm;
  return out;
}

bool MovingSurface::mend() { return mend(kRoundsInAStep); }

bool MovingSurface::mend(int max_rounds) {
  const TriMesh unmended = mesh_;
  AdaptivityOptions sizes = adaptivity();
  AdaptivityReport adapted = adapt(mesh_, sizes, max_rounds);
  is_limited_ |= adapted.is_limited;
  ImproveOptions improvement;
  improvement.min_length = kShortest * options_.edge_length_mm;
  improvement.max_length = sizes.max_length_mm;
  improvement.tolerance_mm = kTolerance * options_.edge_length_mm;
  improvement.may_coarsen = std::move(adapted.may_coarsen);
  if (sizes.geometry_tolerance_mm > 0)
    improvement.max_variation_mm = sizes.gamma_refine * sizes.geometry_tolerance_mm;
  const ImproveReport improved = improve(mesh_, improvement);
  const bool has_moved_surface =
      adapted.n_coarsened + improved.n_collapsed + improved.n_flipped + improved.n_moved > 0;
  if (!has_moved_surface) return adapted.n_refined > 0;
  // Its checks are local: where far parts come to intersect only refinement is left.
  if (!adds_intersections(to_triangles(unmended), to_triangles(mesh_))) return true;
  mesh_ = unmended;
  sizes.gamma_coarsen = 0;
  return adapt(mesh_, sizes, max_rounds).n_refined > 0;
}

std::string MovingSurface::obstacle() const {
  const fem::Geometry<3> shape = geometry();
  if (shape.radius() < options_.min_radius * options_.edge_length_mm)
    return fmt::format("the object vanished: its volume fell to {:.3g} mm^3", shape.enclosed());
  const double share = border_share();
  if (share > options_.max_border_share)
    return fmt::format("the surface meets the volume's border with {:.0f} % of its area",
                       100 * share);
  return {};
}

double MovingSurface::border_share() const {
  if (!options_.box) return 0;
  constexpr double kNear = 1e-6;  // voxels
  const VolumeBox& box = *options_.box;
  const Eigen::Array3d last(box.size[0] - 1, box.size[1] - 1, box.size[2] - 1);
  const Points<3> X = points(mesh_);
  return share_of_area(X, elements(mesh_), [&](int i) {
    const Eigen::Array3d index = (box.world_to_index * X.row(i).transpose()).array();
    return (index <= kNear).any() || (index >= last - kNear).any();
  });
}

}  // namespace surf::mesh
