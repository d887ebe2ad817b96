#include "libcurve/io/contour_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "libcurve/mesh/hierarchy.h"
#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/vtp_file.h"

namespace surf::curve {
namespace {

using Eigen::Vector2d;
using io::surf_vtp_bytes;  // by its own name, which SURF_LATE looks for
using nlohmann::ordered_json;

using Ring = std::vector<Vector2d>;

/// A connected part of the domain: its outer ring, then its holes.
struct Polygon {
  std::vector<Ring> rings;
  double area_mm2 = 0, length_mm = 0;
};

std::vector<Polygon> polygons_of(const Segments& curves) {
  if (curves.elements.rows() == 0) return {};
  const CurveHierarchy hierarchy = curve_hierarchy(curves);
  std::vector<int> next(curves.points.rows(), -1);
  for (const auto element : curves.elements.rowwise()) next[element[0]] = element[1];
  const auto ring = [&](int component) {
    Ring out;
    const int first = curves.elements(hierarchy.components[component].first_element, 0);
    for (int at = first; out.empty() || at != first; at = next[at])
      out.emplace_back(curves.points.row(at));
    return out;
  };
  std::vector<Polygon> out;
  for (const Region& region : regions(hierarchy)) {
    Polygon& polygon = out.emplace_back();
    polygon.area_mm2 = region.area_mm2;
    polygon.length_mm = region.length_mm;
    polygon.rings.push_back(ring(region.outer));
    for (const int hole : region.holes) polygon.rings.push_back(ring(hole));
  }
  return out;
}

Points<3> placed(const Ring& ring, const std::optional<Eigen::Affine3d>& plane_to_ras,
                 io::Space space) {
  Points<3> points(ring.size(), 3);
  for (std::size_t i = 0; i < ring.size(); ++i) {
    Eigen::Vector3d point(ring[i][0], ring[i][1], 0);
    if (plane_to_ras) point = *plane_to_ras * point;
    points.row(Eigen::Index(i)) = point.transpose();
  }
  return plane_to_ras ? io::converted(points, space) : points;
}

template <class Matrix>
ordered_json rows_of(const Matrix& matrix) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i + 1 < matrix.rows(); ++i) {
    ordered_json row = ordered_json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    out.push_back(row);
  }
  return out;
}

ordered_json feature_of(const Polygon& polygon,
                        const std::function<ordered_json(const Ring&)>& list) {
  ordered_json coordinates = ordered_json::array();
  for (const Ring& ring : polygon.rings) {
    ordered_json points = list(ring);
    points.push_back(points.front());
    coordinates.push_back(std::move(points));
  }
  return {{"type", "Feature"},
          {"properties",
           {{"area_mm2", polygon.area_mm2},
            {"length_mm", polygon.length_mm},
            {"holes", polygon.rings.size() - 1}}},
          {"geometry", {{"type", "Polygon"}, {"coordinates", std::move(coordinates)}}}};
}

std::string json_text(const std::vector<Polygon>& polygons, const Image& image) {
  ordered_json out = {{"type", "FeatureCollection"},
                      {"unit", "mm"},
                      {"size", image.size()},
                      {"pixel_to_mm", rows_of(image.pixel_to_plane().matrix())}};
  if (image.plane_to_ras()) {
    out["mm_to_ras"] = rows_of(image.plane_to_ras()->matrix());
    if (image.thickness_mm() > 0) out["thickness_mm"] = image.thickness_mm();
  }
  out["features"] = ordered_json::array();
  for (const Polygon& polygon : polygons)
    out["features"].push_back(feature_of(polygon, [](const Ring& ring) {
      ordered_json points = ordered_json::array();
      for (const Vector2d& point : ring) points.push_back({point[0], point[1]});
      return points;
    }));
  return out.dump() + "\n";
}

std::string csv_text(const std::vector<Polygon>& polygons) {
  std::string text = "polygon,ring,x_mm,y_mm\n";
  for (std::size_t p = 0; p < polygons.size(); ++p)
    for (std::size_t r = 0; r < polygons[p].rings.size(); ++r)
      for (const Vector2d& point : polygons[p].rings[r])
        text += fmt::format("{},{},{},{}\n", p, r, point[0], point[1]);
  return text;
}

std::string svg_text(const std::vector<Polygon>& polygons, const Image& image) {
  const auto& size = image.size();
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\">\n",
      size[0], size[1]);
  for (const Polygon& polygon : polygons) {
    text +=
        "<path fill=\"#ff6020\" fill-opacity=\"0.2\" fill-rule=\"evenodd\" stroke=\"#ff6020\" "
        "stroke-width=\"1\" d=\"";
    for (const Ring& ring : polygon.rings) {
      char command = 'M';
      for (const Vector2d& point : ring) {
        const Vector2d pixel = (image.plane_to_pixel() * point).array() + 0.5;
        text += fmt::format("{}{} {}", command, pixel[0], pixel[1]);
        command = 'L';
      }
      text += 'Z';
    }
    text += "\"/>\n";
  }
  return text + "</svg>\n";
}

/// Closed lines with the number of their slice.
class Lines {
 public:
  void add(const Points<3>& ring, int slice) {
    std::vector<int>& corners = rings_.emplace_back(std::size_t(ring.rows()));
    std::iota(corners.begin(), corners.end(), int(points_.size()));
    for (const auto point : ring.rowwise()) points_.push_back(point);
    slices_.push_back(slice);
  }
  std::string file(io::Space space, bool has_slices) const {
    io::VtpContent content;
    content.surface.points.resize(Eigen::Index(points_.size()), 3);
    for (std::size_t i = 0; i < points_.size(); ++i)
      content.surface.points.row(Eigen::Index(i)) = points_[i];
    content.is_of_lines = true;
    content.rings = rings_;
    if (has_slices) content.slices = slices_;
    return SURF_LATE(surf_vtk, surf_vtp_bytes)(content, space);
  }

 private:
  std::vector<Eigen::RowVector3d> points_;
  std::vector<std::vector<int>> rings_;
  std::vector<int> slices_;
};

std::string vtp_text(const std::vector<Polygon>& polygons, const Image& image, io::Space space) {
  Lines lines;
  for (const Polygon& polygon : polygons)
    for (const Ring& ring : polygon.rings) lines.add(placed(ring, image.plane_to_ras(), space), 0);
  return lines.file(image.plane_to_ras() ? space : io::Space::kRas, false);
}

UsageError wrong_ending(const std::string& path, const char* endings) {
  return UsageError(fmt::format("{}: expected a name that ends in {}", path, endings));
}

std::string stack_json(const std::vector<SliceContours>& stack, io::Space space) {
  ordered_json out = {{"type", "FeatureCollection"}, {"unit", "mm"}, {"space", io::name(space)}};
  out["features"] = ordered_json::array();
  for (const SliceContours& slice : stack)
    for (const Polygon& polygon : polygons_of(slice.curves)) {
      ordered_json feature = feature_of(polygon, [&](const Ring& ring) {
        ordered_json points = ordered_json::array();
        const Points<3> world = placed(ring, slice.plane_to_ras, space);
        for (const auto point : world.rowwise()) points.push_back({point[0], point[1], point[2]});
        return points;
      });
      feature["properties"]["slice"] = slice.slice;
      out["features"].push_back(std::move(feature));
    }
  return out.dump() + "\n";
}

std::string stack_csv(const std::vector<SliceContours>& stack, io::Space space) {
  const std::string unit = space == io::Space::kLps ? "lps_mm" : "ras_mm";
  std::string text = fmt::format("slice,polygon,ring,x_{0},y_{0},z_{0}\n", unit);
  for (const SliceContours& slice : stack) {
    const auto polygons = polygons_of(slice.curves);
    for (std::size_t p = 0; p < polygons.size(); ++p)
      for (std::size_t r = 0; r < polygons[p].rings.size(); ++r) {
        const Points<3> world = placed(polygons[p].rings[r], slice.plane_to_ras, space);
        for (const auto point : world.rowwise())
          text +=
              fmt::format("{},{},{},{},{},{}\n", slice.slice, p, r, point[0], point[1], point[2]);
      }
  }
  return text;
}

std::string stack_vtp(const std::vector<SliceContours>& stack, io::Space space) {
  Lines lines;
  for (const SliceContours& slice : stack)
    for (const Polygon& polygon : polygons_of(slice.curves))
      for (const Ring& ring : polygon.rings)
        lines.add(placed(ring, slice.plane_to_ras, space), slice.slice);
  return lines.file(space, true);
}

}  // namespace

bool is_writable_contour(const std::string& path) {
  const std::string ending = extension(path);
  return ending == ".svg" || ending == ".json" || ending == ".vtp" || ending == ".csv";
}

void write_contours(const std::string& path, const Segments& curves, const Image& image,
                    io::Space space) {
  if (!is_writable_contour(path)) throw wrong_ending(path, ".svg, .json, .vtp or .csv");
  const std::string ending = extension(path);
  const std::vector<Polygon> polygons = polygons_of(curves);
  write_bytes(path, ending == ".json"  ? json_text(polygons, image)
                    : ending == ".csv" ? csv_text(polygons)
                    : ending == ".svg" ? svg_text(polygons, image)
                                       : vtp_text(polygons, image, space));
}

void write_stack(const std::string& path, const std::vector<SliceContours>& stack,
                 io::Space space) {
  const std::string ending = extension(path);
  if (ending == ".json")
    write_bytes(path, stack_json(stack, space));
  else if (ending == ".csv")
    write_bytes(path, stack_csv(stack, space));
  else if (ending == ".vtp")
    write_bytes(path, stack_vtp(stack, space));
  else
    throw wrong_ending(path, ".json, .vtp or .csv");
}

}  // namespace surf::curve
