#include "libsurf/segment/detail/surface_setting.h"

#include <algorithm>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/error.h"
#include "libsurf/base/padding.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/difference.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/sheet_guard.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/detail/volume_model.h"

namespace surf::segment {
namespace {

// Of triangles that are moved as they are, without mending: others are not made worse than that.
constexpr double kLeastAngleDeg = 20;

mesh::SolidFilter solid_filter(const ComponentOptions& options,
                               const std::vector<Vector<3>>& seeds) {
  mesh::SolidFilter filter;
  filter.fill_cavities = options.fill_cavities;
  filter.min_volume_mm3 = options.min_content;
  filter.keep = options.keep;
  filter.seeds_ras_mm.resize(Eigen::Index(seeds.size()), 3);
  for (std::size_t n = 0; n < seeds.size(); ++n) filter.seeds_ras_mm.row(n) = seeds[n];
  return filter;
}

Part<3> part_of(const mesh::Shell& shell) {
  return {std::abs(shell.volume_mm3), shell.area_mm2, shell.genus, shell.center_ras_mm};
}

/// One entry for each outer shell, its cavities in it; volumes are those that the shells enclose.
std::vector<Component<3>> components_of(const Triangles& surface) {
  const mesh::ShellHierarchy hierarchy = mesh::shell_hierarchy(surface);
  std::vector<Component<3>> out;
  for (const mesh::Solid& solid : mesh::solids(hierarchy)) {
    out.push_back({part_of(hierarchy.shells[solid.outer]), {}});
    for (const int cavity : solid.cavities)
      out.back().cavities.push_back(part_of(hierarchy.shells[cavity]));
  }
  return out;
}

/// The volume itself, or a copy of what was scanned of it.
volume::Volume without_padding(const volume::Volume& volume) {
  const IndexBox<3> scanned = box_within_padding<3>(volume.size(), reader_of(volume));
  if (scanned.size == volume.size()) return volume;
  const Vector<3> first(scanned.lower[0], scanned.lower[1], scanned.lower[2]);
  return {scanned.size, volume.index_to_world() * Eigen::Translation3d(first),
          reader_of(volume)(scanned.lower, scanned.upper())};
}

}  // namespace

SurfaceSetting::SurfaceSetting(const volume::Volume& volume)
    : volume_(volume.in_ras_order()),
      scanned_(without_padding(volume_)),
      extent_(extent_of(scanned_)) {
  extent_.in_file = {volume.size(), volume.index_to_world(), volume.world_to_index()};
}

std::vector<float> SurfaceSetting::values(const std::array<int, 3>& lower,
                                          const std::array<int, 3>& upper) const {
  return reader_of(scanned_)(lower, upper);
}

std::unique_ptr<EnergyModel<3>> SurfaceSetting::make_model(const FieldOptions& options) const {
  return std::make_unique<ImageModel>(scanned_, extent_, options.smoothing, options.filter);
}

std::shared_ptr<const Field<3>> SurfaceSetting::rough_intensity(const FieldOptions& options) const {
  return volume::rough_intensity_field(scanned_, options.smoothing);
}

std::unique_ptr<mesh::MovingMesh<3>> SurfaceSetting::make_shape(
    const Triangles& start, const mesh::MovingShapeOptions<3>& options) const {
  mesh::MovingShapeOptions<3> in_volume = options;
  in_volume.box = extent_;
  return std::make_unique<mesh::MovingSurface>(start, in_volume);
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
  return mesh::surface_of_level(volume::Volume(size, index_to_world, values), level);
}

std::function<double(const Vector<3>&)> SurfaceSetting::distance_to(const Triangles& shape) const {
  return [tree = std::make_shared<const mesh::DistanceToSurface>(shape)](const Vector<3>& point) {
    return (*tree)(point);
  };
}

bool SurfaceSetting::is_embedded(const Triangles& shape) const {
  return mesh::self_intersections(shape).empty();
}

Triangles SurfaceSetting::moved(const Triangles& shape, const Points<3>& to) const {
  Triangles out{to, shape.elements};
  for (Eigen::Index i = 0; i < to.rows(); ++i)
    if (to.row(i) != shape.points.row(i))  // what stays stays to the last bit
      out.points.row(i) =
          extent_.clamped(to.row(i), extent_.faces(shape.points.row(i).transpose())).transpose();
  mesh::hold_slivers(shape.points, out.points, out.elements, kLeastAngleDeg);
  mesh::hold_intersecting(shape.points, out.points, out.elements);
  return out;
}

/// A surface of nothing but phantoms is inverted as a whole, which the verification has words for.
Filtered<3> SurfaceSetting::filtered(const Triangles& shape, const ComponentOptions& options,
                                     const std::vector<Vector<3>>& seeds_mm) const {
  mesh::FilteredSurface filtered = mesh::filtered(shape, solid_filter(options, seeds_mm));
  const bool are_phantoms = std::all_of(
      filtered.removed.begin(), filtered.removed.end(),
      [](const auto& removal) { return removal.reason == mesh::Removal::Reason::kPhantom; });
  if (filtered.removed.empty() || (are_phantoms && filtered.surface.elements.rows() == 0))
    return {shape, {}};
  Filtered<3> out{std::move(filtered.surface), {}};
  for (const mesh::Removal& removal : filtered.removed)
    out.removed.push_back({mesh::to_string(removal.reason), removal.n_shells, removal.volume_mm3,
                           removal.center_ras_mm});
  return out;
}

bool SurfaceSetting::do_overlap(const Triangles& first, const Triangles& second) const {
  return mesh::do_overlap(first, second);
}

mesh::Parted<3> SurfaceSetting::parted(const Triangles& shape, const Triangles& other,
                                       const mesh::PartOptions<3>& options) const {
  return mesh::parted(shape, other, options);
}

Measures<3> SurfaceSetting::measures(const Triangles& shape) const {
  const mesh::Verification check = mesh::verify(shape);
  const mesh::Quality quality = mesh::quality(shape);
  Measures<3> out;
  out.passed = check.passed();
  out.verdict = check.message();
  out.closed = check.closed;
  out.manifold = check.manifold;
  out.outward = check.outward;
  out.n_components = check.n_components;
  out.n_self_intersections = check.n_self_intersections;
  out.n_degenerate = check.n_degenerate;
  out.n_vertices = shape.points.rows();
  out.n_elements = shape.elements.rows();
  out.content = mesh::volume_mm3(shape);
  out.measure = mesh::area_mm2(shape);
  out.centroid_mm = mesh::centroid(shape);
  out.min_angle_deg = quality.min_angle_deg;
  out.share_above_25_deg = quality.share_above_25_deg;
  if (out.passed) out.components = components_of(shape);
  return out;
}

Triangles SurfaceSetting::rounded_to_file(const Triangles& shape,
                                          const std::string& extension) const {
  return extension.empty() ? shape : io::rounded_to_file(shape, extension);
}

Triangles SurfaceSetting::in_file_order(const Triangles& shape) const {
  std::vector<int> place(std::size_t(shape.points.rows()), -1);
  Triangles out{Points<3>(shape.points.rows(), 3), shape.elements};
  int n = 0;
  for (Eigen::Index t = 0; t < out.elements.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      int& vertex = out.elements(t, i);
      if (place[vertex] < 0) {
        place[vertex] = n;
        out.points.row(n++) = shape.points.row(vertex);
      }
      vertex = place[vertex];
    }
  out.points.conservativeResize(n, 3);
  return out;
}

std::string SurfaceSetting::hash_content() const {
  ContentHash hash;
  hash.add(volume_.size());
  hash.add(volume_.index_to_world().matrix());
  std::vector<float> slice(std::size_t(volume_.size()[0]) * volume_.size()[1]);
  for (int k = 0; k < volume_.size()[2]; ++k) {
    volume_.copy_box({0, 0, k}, {volume_.size()[0], volume_.size()[1], k + 1}, slice.data());
    hash.add(slice);
  }
  return hash.digits();
}

}  // namespace surf::segment
