#include "libsurf/segment/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/sheet_guard.h"
#include "libsurf/segment/model.h"
#include "libsurf/segment/surface_setting.h"

namespace surf::segment {
namespace {

void check_seeds(const volume::Volume& volume, const std::vector<Eigen::Vector3d>& seeds) {
  for (const Eigen::Vector3d& seed : seeds) {
    const Eigen::Vector3d index = volume.world_to_index() * seed;
    for (int axis = 0; axis < 3; ++axis)
      if (!(index[axis] >= 0 && index[axis] <= volume.size()[axis] - 1))
        throw UsageError(fmt::format(
            "--seed: ({:g}, {:g}, {:g}) RAS mm is voxel ({:.1f}, {:.1f}, {:.1f}), outside the "
            "volume of {} x {} x {} voxels; is it in another space (--space)?",
            seed[0], seed[1], seed[2], index[0], index[1], index[2], volume.size()[0],
            volume.size()[1], volume.size()[2]));
  }
}

mesh::SolidFilter solid_filter(const SegmentOptions& options) {
  const std::vector<Vector<3>>& seeds = options.seeds_mm;
  mesh::SolidFilter filter = options.solids;
  filter.seeds_ras_mm.resize(Eigen::Index(seeds.size()), 3);
  for (std::size_t n = 0; n < seeds.size(); ++n) filter.seeds_ras_mm.row(n) = seeds[n];
  return filter;
}

/// One note for each reason: how many, how large, where the largest is.
void add_notes(const std::vector<mesh::Removal>& removed, std::vector<std::string>& notes) {
  struct Group {
    int n = 0;
    double total = 0;
    const mesh::Removal* largest = nullptr;
  };
  std::map<mesh::Removal::Reason, Group> groups;
  for (const mesh::Removal& removal : removed) {
    Group& group = groups[removal.reason];
    ++group.n;
    group.total += std::abs(removal.volume_mm3);
    if (!group.largest || std::abs(removal.volume_mm3) > std::abs(group.largest->volume_mm3))
      group.largest = &removal;
  }
  for (const auto& [reason, group] : groups) {
    const Eigen::Vector3d& at = group.largest->center_ras_mm;
    const std::string largest =
        fmt::format("{:.4g} mm^3 at ({:.4g}, {:.4g}, {:.4g}) RAS mm",
                    std::abs(group.largest->volume_mm3), at[0], at[1], at[2]);
    const std::string what =
        fmt::format("removed: {} {}", group.n, mesh::to_string(reason, group.n));
    notes.push_back(group.n == 1 ? fmt::format("{} of {}", what, largest)
                                 : fmt::format("{}, {:.4g} mm^3 in all, the largest of {}", what,
                                               group.total, largest));
  }
}

/// Phantoms go, and what the options rule out. A surface of nothing but phantoms is inverted as a
/// whole, which the verification has words for.
void filter_solids(const SegmentOptions& options, SegmentResult& result) {
  mesh::FilteredSurface filtered = mesh::filtered(result.shape, solid_filter(options));
  const bool are_phantoms = std::all_of(
      filtered.removed.begin(), filtered.removed.end(),
      [](const auto& removal) { return removal.reason == mesh::Removal::Reason::kPhantom; });
  if (filtered.removed.empty() || (are_phantoms && filtered.surface.elements.rows() == 0)) return;
  result.shape = std::move(filtered.surface);
  result.removed = std::move(filtered.removed);
  add_notes(result.removed, result.notes);
}

class GrowingSurface : public GrowingShape<3> {
 public:
  GrowingSurface(const Triangles& start, const mesh::MovingSurfaceOptions& options)
      : surface_(start, options) {}

  flow::MovingShape<3>& moving() override { return surface_; }
  Triangles simplices() const override { return surface_.triangles(); }
  double border_share() const override { return surface_.border_share(); }
  bool is_limited() const override { return surface_.is_limited(); }
  void set_edge_length(double edge_length_mm) override { surface_.set_edge_length(edge_length_mm); }
  void set_integrands(std::vector<std::shared_ptr<const Field<3>>> integrands) override {
    surface_.set_integrands(std::move(integrands));
  }

 private:
  mesh::MovingSurface surface_;
};

}  // namespace

SurfaceSetting::SurfaceSetting(const volume::Volume& volume, volume::DerivativeFilter filter)
    : volume_(volume), filter_(filter), extent_(extent_of(volume)) {}

std::unique_ptr<EnergyModel<3>> SurfaceSetting::make_model(
    const volume::SmoothingOptions& smoothing) const {
  return std::make_unique<ImageModel>(volume_, smoothing, filter_);
}

std::unique_ptr<GrowingShape<3>> SurfaceSetting::make_shape(const Triangles& start,
                                                            const ShapeOptions<3>& options) const {
  auto surface = options.to<mesh::MovingSurfaceOptions>();
  surface.box = volume_box(volume_);
  return std::make_unique<GrowingSurface>(start, surface);
}

Triangles SurfaceSetting::ball(const Vector<3>& center, double radius, double edge_length) const {
  return mesh::ball(center, radius, edge_length);
}

Triangles SurfaceSetting::joined(const std::vector<Triangles>& parts) const {
  return mesh::joined(parts);
}

Triangles SurfaceSetting::flipped(const Triangles& shape) const { return mesh::flipped(shape); }

std::vector<std::uint8_t> SurfaceSetting::rasterized(const Triangles& shape,
                                                     const std::array<int, 3>& size,
                                                     const Eigen::Affine3d& index_to_world) const {
  return mesh::rasterize(shape, size, index_to_world);
}

Triangles SurfaceSetting::shape_of_level(std::span<const float> values,
                                         const std::array<int, 3>& size,
                                         const Eigen::Affine3d& index_to_world,
                                         double level) const {
  return mesh::surface_of_level({size, index_to_world, values}, level);
}

bool SurfaceSetting::is_embedded(const Triangles& shape) const {
  return mesh::self_intersections(shape).empty();
}

Triangles SurfaceSetting::moved(const Triangles& shape, const Points<3>& to) const {
  Triangles out{to, shape.elements};
  mesh::hold_intersecting(shape.points, out.points, out.elements);
  return out;
}

std::string SegmentOptions::error() const {
  if (std::string error = RunOptions<3>::error(); !error.empty()) return error;
  return solid_filter(*this).error();
}

SegmentResult segment(const volume::Volume& volume, const SegmentOptions& options,
                      const Progress& progress) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  check_terms(options.energies);
  check_seeds(volume, options.seeds_mm);
  SegmentResult result;
  static_cast<RunResult<3>&>(result) =
      run<3>(SurfaceSetting(volume, options.derivative_filter), options, progress);
  filter_solids(options, result);
  return result;
}

}  // namespace surf::segment
