#include "tools/report/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "libsurf/base/base64.h"
#include "libsurf/io/thinned.h"

namespace surfseg::report {
namespace {

using nlohmann::ordered_json;
using surf::Vector;

template <class Integer>
void append(std::string& bytes, Integer value) {
  for (std::size_t k = 0; k < sizeof value; ++k) bytes += char(value >> (8 * k) & 0xff);
}

// Triangles of an object beside much larger ones: of fewer nothing may be left.
constexpr Eigen::Index kFewest = 200;

/// In [0, 255] from 0 to the largest that is shown.
std::string bytes_of(const std::vector<double>& values, double most) {
  std::string out;
  for (const double value : values)
    out += char(std::lround(255 * std::clamp(most > 0 ? value / most : 0, 0.0, 1.0)));
  return out;
}

ordered_json certainty_json(const surf::segment::Certainty<3>& certainty,
                            const std::vector<int>& nearest) {
  std::vector<double> deviations;
  std::string has_edge;
  for (const int vertex : nearest) {
    deviations.push_back(certainty.deviation_mm[vertex]);
    has_edge += certainty.has_edge[vertex] ? '\1' : '\0';
  }
  std::vector<double> sorted = deviations;
  const auto at = sorted.begin() + std::ptrdiff_t(0.98 * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  return {{"most_mm", *at},
          {"deviation", surf::base64(bytes_of(deviations, *at))},
          {"edge", surf::base64(has_edge)}};
}

ordered_json object_json(const ReportedObject<3>& object, const std::string& name,
                         const std::string& colour, Eigen::Index n_triangles) {
  const surf::io::Thinned thinned = surf::io::thinned(object.finished->shape, n_triangles);
  const surf::Triangles& shape = thinned.surface;
  const Vector<3> low = shape.points.colwise().minCoeff(), high = shape.points.colwise().maxCoeff();
  std::string points, triangles;
  for (const auto point : shape.points.rowwise())
    for (int axis = 0; axis < 3; ++axis)
      append(points, std::uint16_t(std::lround(65535 * (point[axis] - low[axis]) /
                                               std::max(high[axis] - low[axis], 1e-9))));
  const bool is_short = shape.points.rows() <= 65536;
  for (const auto element : shape.elements.rowwise())
    for (const int vertex : element)
      if (is_short)
        append(triangles, std::uint16_t(vertex));
      else
        append(triangles, std::uint32_t(vertex));
  ordered_json clicks = ordered_json::array();
  for (const auto& click : object.object->clicks)
    clicks.push_back({click.point_mm[0], click.point_mm[1], click.point_mm[2],
                      click.side == surf::segment::Side::kInside ? 1 : 0});
  ordered_json out = {{"name", name},
                      {"colour", colour},
                      {"low", {low[0], low[1], low[2]}},
                      {"high", {high[0], high[1], high[2]}},
                      {"points", surf::base64(points)},
                      {"bits", is_short ? 16 : 32},
                      {"triangles", surf::base64(triangles)},
                      {"clicks", clicks}};
  if (object.finished->certainty)
    out["certainty"] = certainty_json(*object.finished->certainty, thinned.nearest);
  return out;
}

}  // namespace

std::string colour_of(std::size_t n) {
  static constexpr std::array kColours = {"#4e9ad4", "#e0853c", "#58a866", "#c95d63",
                                          "#9a7cc4", "#b39a3b", "#4fb3b0", "#d57ba6"};
  return kColours[n % kColours.size()];
}

Scene scene(const std::vector<ReportedObject<3>>& objects, Eigen::Index most_triangles) {
  Eigen::Index n_all = 0, n_shown = 0;
  std::size_t n_shapes = 0;
  for (const auto& object : objects)
    if (object.finished) n_all += object.finished->shape.elements.rows(), ++n_shapes;
  Scene out;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (!objects[n].finished) continue;
    const Eigen::Index own = objects[n].finished->shape.elements.rows();
    const Eigen::Index share =
        n_all <= most_triangles
            ? own
            : std::max(kFewest, Eigen::Index(double(most_triangles) * double(own) / double(n_all)));
    const std::string& name = objects[n].object->name;
    out.json.push_back(
        object_json(objects[n], name.empty() ? "surface" : name, colour_of(n), share));
    n_shown += std::min(own, share);
  }
  if (n_shown < n_all)
    out.thinned = fmt::format(
        "To keep this page small the view shows about {} triangles in place of {}; every number "
        "and the pictures of slices are of the whole surface.",
        n_shown, n_all);
  return out;
}

}  // namespace surfseg::report
