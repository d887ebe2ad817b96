#include "libcurve/segment/detail/curve_setting.h"

#include "libcurve/mesh/difference.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/from_level.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/moving_curve.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/detail/image_model.h"
#include "libcurve/segment/region_filter.h"
#include "libsurf/base/content_hash.h"
#include "libsurf/base/padding.h"
#include "libsurf/base/products.h"
#include "libsurf/base/rounding_step.h"
#include "libsurf/base/usual_range.h"
#include "libsurf/segment/detail/some_values.h"

namespace surf::curve {

namespace {

/// Copies boxes of it.
auto reader_of(const Image& image) {
  return [&image](const std::array<int, 2>& lower, const std::array<int, 2>& upper) {
    std::vector<float> out;
    for (int j = lower[1]; j < upper[1]; ++j)
      for (int i = lower[0]; i < upper[0]; ++i) out.push_back(image.value(i, j));
    return out;
  };
}

/// The image itself, or a copy of what was scanned of it.
Image without_padding(const Image& image) {
  const IndexBox<2> scanned = box_within_padding<2>(image.size(), reader_of(image));
  if (scanned.size == image.size()) return image;
  const Vector<2> first(scanned.lower[0], scanned.lower[1]);
  return {scanned.size, image.pixel_to_plane() * Eigen::Translation2d(first),
          reader_of(image)(scanned.lower, scanned.upper())};
}

/// Centre of mass of what the curves enclose, by Green's formula.
Vector<2> centroid(const Segments& curves, double area_mm2) {
  const Vector<2> base = curves.points.row(0).transpose();
  Vector<2> moment = Vector<2>::Zero();
  for (const auto e : curves.elements.rowwise()) {
    const Vector<2> a = curves.points.row(e[0]).transpose() - base,
                    b = curves.points.row(e[1]).transpose() - base;
    moment += cross(a, b) / 6 * (a + b);
  }
  return base + moment / area_mm2;
}

}  // namespace

CurveSetting::CurveSetting(const Image& image)
    : image_(image),
      scanned_(without_padding(image)),
      extent_{{scanned_.size(), scanned_.pixel_to_plane(), scanned_.plane_to_pixel()},
              scanned_.range(),
              rounding_step(scanned_.values(), std::size_t(scanned_.size()[0]))} {
  extent_.usual =
      usual_range(extent_.range, segment::some_values<2>(extent_.size, reader_of(scanned_)));
  extent_.in_file = {image.size(), image.pixel_to_plane(), image.plane_to_pixel()};
}

std::vector<float> CurveSetting::values(const std::array<int, 2>& lower,
                                        const std::array<int, 2>& upper) const {
  return reader_of(scanned_)(lower, upper);
}

std::unique_ptr<segment::EnergyModel<2>> CurveSetting::make_model(
    const volume::FieldOptions& options) const {
  return std::make_unique<ImageModel>(scanned_, extent_, options);
}

std::unique_ptr<mesh::MovingMesh<2>> CurveSetting::make_shape(
    const Segments& start, const mesh::MovingShapeOptions<2>& options) const {
  mesh::MovingShapeOptions<2> in_image = options;
  in_image.box = extent_;
  return std::make_unique<MovingCurve>(start, in_image);
}

Segments CurveSetting::ball(const Vector<2>& center, double radius, double edge_length) const {
  return circle(center, radius, edge_length);
}

Segments CurveSetting::joined(const std::vector<Segments>& parts) const {
  return curve::joined(parts);
}

Segments CurveSetting::flipped(const Segments& shape) const { return curve::flipped(shape); }

std::vector<std::uint8_t> CurveSetting::rasterized(const Segments& shape,
                                                   const std::array<int, 2>& size,
                                                   const Eigen::Affine2d& index_to_world) const {
  return rasterize(shape, size, index_to_world);
}

Segments CurveSetting::shape_of_level(std::span<const float> values, const std::array<int, 2>& size,
                                      const Eigen::Affine2d& index_to_world, double level) const {
  return curve_of_level(values, size, index_to_world, level);
}

std::function<double(const Vector<2>&)> CurveSetting::distance_to(const Segments& shape) const {
  return [tree = std::make_shared<const DistanceToCurves>(shape)](const Vector<2>& point) {
    return (*tree)(point);
  };
}

bool CurveSetting::is_embedded(const Segments& shape) const {
  return intersections(shape.points, shape.elements).empty();
}

/// Nodes of elements that would intersect stay where they are, until none does.
Segments CurveSetting::moved(const Segments& shape, const Points<2>& to) const {
  Segments out{to, shape.elements};
  for (Eigen::Index i = 0; i < to.rows(); ++i)
    if (to.row(i) != shape.points.row(i))  // what stays stays to the last bit
      out.points.row(i) =
          extent_.clamped(to.row(i), extent_.faces(shape.points.row(i).transpose())).transpose();
  while (true) {
    const auto pairs = intersections(out.points, out.elements);
    bool has_changed = false;
    for (const auto& [a, b] : pairs)
      for (const int element : {a, b})
        for (const int node : {out.elements(element, 0), out.elements(element, 1)}) {
          has_changed |= out.points.row(node) != shape.points.row(node);
          out.points.row(node) = shape.points.row(node);
        }
    if (!has_changed) return out;
  }
}

segment::Filtered<2> CurveSetting::filtered(const Segments& shape,
                                            const segment::ComponentOptions& options,
                                            const std::vector<Vector<2>>& seeds_mm) const {
  if (shape.elements.rows() == 0) return {shape, {}};
  FilteredCurves filtered =
      curve::filtered(shape, {options.fill_cavities, options.min_content, options.keep, seeds_mm});
  segment::Filtered<2> out{std::move(filtered.curves), {}};
  for (const RemovedRegion& removed : filtered.removed)
    out.removed.push_back({removed.what, removed.n_curves, removed.area_mm2, removed.center_mm});
  return out;
}

bool CurveSetting::do_overlap(const Segments& first, const Segments& second) const {
  return curve::do_overlap(first, second);
}

mesh::Parted<2> CurveSetting::parted(const Segments& shape, const Segments& other,
                                     const mesh::PartOptions<2>& options) const {
  return curve::parted(shape, other, options);
}

segment::Measures<2> CurveSetting::measures(const Segments& shape) const {
  const Verification check = verify(shape);
  segment::Measures<2> out;
  out.passed = check.passed();
  out.verdict = check.message();
  out.closed = check.closed;
  out.manifold = check.simple;
  out.outward = check.alternating;
  out.n_components = check.n_components;
  out.n_self_intersections = check.n_intersections;
  out.n_degenerate = check.n_degenerate;
  out.n_vertices = shape.points.rows();
  out.n_elements = shape.elements.rows();
  if (!out.passed) return out;
  const CurveHierarchy hierarchy = curve_hierarchy(shape);
  const auto part_of = [&](int n) {
    const Component& component = hierarchy.components[n];
    return segment::Part<2>{std::abs(component.area_mm2), component.length_mm, 0, component.centre};
  };
  for (const Region& region : regions(hierarchy)) {
    out.components.push_back({part_of(region.outer), {}});
    for (const int hole : region.holes) out.components.back().cavities.push_back(part_of(hole));
    out.content += region.area_mm2;
    out.measure += region.length_mm;
  }
  out.centroid_mm = centroid(shape, out.content);
  return out;
}

/// Contour files hold doubles.
Segments CurveSetting::rounded_to_file(const Segments& shape, const std::string&) const {
  return shape;
}

Segments CurveSetting::in_file_order(const Segments& shape) const {
  return curve::in_file_order(shape);
}

std::string CurveSetting::hash_content() const {
  ContentHash hash;
  hash.add(image_.size());
  hash.add(image_.pixel_to_plane().matrix());
  hash.add(image_.values());
  return hash.digits();
}

}  // namespace surf::curve
