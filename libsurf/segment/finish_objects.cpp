#include "libsurf/segment/finish_objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/segment/detail/float_step.h"

namespace surf::segment {
namespace {

constexpr double kLeastThickness = 0.5;  // cells, of a piece that a cut leaves
constexpr double kLeastContent = 1;      // cells
constexpr double kMostOfGap = 0.25;      // between two floats of a file

template <int Dim>
double power(double x) {
  return Dim == 3 ? x * x * x : x * x;
}

/// What of a shape lies along another one: the elements whose corners and centre are no farther
/// than the greatest gap.
template <int Dim>
void measure_wall(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                  const Simplices<Dim>& other, Wall& wall) {
  const double most = kMostGapOfWalls * setting.extent().cell_mm();
  const auto distance = setting.distance_to(other);
  std::vector<double> of_point(shape.points.rows());
  for (std::size_t i = 0; i < of_point.size(); ++i)
    of_point[i] = distance(shape.points.row(Eigen::Index(i)).transpose());
  const fem::Geometry<Dim> geometry(shape.points, shape.elements);
  for (Eigen::Index e = 0; e < shape.elements.rows(); ++e) {
    double here = 0;
    Vector<Dim> centre = Vector<Dim>::Zero();
    for (const int corner : shape.elements.row(e)) {
      here = std::max(here, of_point[corner]);
      centre += shape.points.row(corner).transpose() / Dim;
    }
    if (here > most) continue;
    here = std::max(here, distance(centre));
    if (here > most) continue;
    wall.measure += geometry.measures()[e];
    wall.greatest_gap = std::max(wall.greatest_gap, here);
  }
}

/// What the earlier objects leave of a result.
template <int Dim>
Finished<Dim> beside_others(const Setting<Dim>& setting, const Result<Dim>& result,
                            std::span<const FinishedObject<Dim>> earlier,
                            const std::string& extension, std::span<const std::string> names,
                            FinishedObject<Dim>& out) {
  Finished<Dim> finished = finish<Dim>(setting, result, extension);
  const auto name = [&](std::size_t n) {
    return n < names.size() ? "'" + names[n] + "'" : fmt::format("object {}", n + 1);
  };
  const double cell = setting.extent().cell_mm();
  const mesh::PartOptions<Dim> options{.gap_mm = kGapOfWalls * cell,
                                       .min_content = kLeastContent * power<Dim>(cell),
                                       .min_thickness_mm = kLeastThickness * cell,
                                       .rounded = [&](const Simplices<Dim>& shape) {
                                         return setting.rounded_to_file(shape, extension);
                                       }};
  const Simplices<Dim> whole = finished.shape;
  // Of a gap of a few floats rounding may leave nothing.
  std::string why;
  if (const double step = float_step<Dim>(whole.points);
      whole.points != result.shape.points && step > kMostOfGap * options.gap_mm)
    why = float_step_text(step);
  for (std::size_t n = 0; n < earlier.size(); ++n) {
    if (!earlier[n].finished) continue;
    mesh::Parted<Dim> left;
    try {
      left = setting.parted(finished.shape, earlier[n].finished->shape, options);
    } catch (const InvalidMesh& none) {
      throw InvalidMesh(
          fmt::format("beside {}: {}; click outside where one of the two leaks into the other{}",
                      name(n), none.what(), why));
    }
    if (!left.has_changed) continue;
    if (left.shape.elements.rows() == 0)
      throw InvalidMesh(
          fmt::format("nothing of it is left beside {}, which has all of it: {:.4g} mm^{}; click "
                      "outside where that one leaks, or put this one before it",
                      name(n), left.removed, Dim));
    out.walls.push_back({.other = n, .removed = left.removed, .n_crumbs = left.n_crumbs});
    finished.shape = std::move(left.shape);
  }
  if (out.walls.empty()) return finished;
  finished.certainty.reset();  // that of vertices that are no longer there
  // A later cut may bring the shape near an earlier wall again only by rounding; it is looked at.
  for (std::size_t n = 0; n < earlier.size(); ++n)
    if (earlier[n].finished && setting.do_overlap(finished.shape, earlier[n].finished->shape))
      throw InvalidMesh(fmt::format("overlaps {}, though it was cut at its wall{}", name(n), why));
  finished.measures = setting.measures(finished.shape);
  if (!finished.measures.passed) throw InvalidMesh(finished.measures.verdict + why);
  for (Wall& wall : out.walls)
    measure_wall<Dim>(setting, finished.shape, earlier[wall.other].finished->shape, wall);
  out.whole = whole;
  return finished;
}

}  // namespace

template <int Dim>
std::vector<FinishedObject<Dim>> finish_objects(const Setting<Dim>& setting,
                                                std::span<const Result<Dim>* const> results,
                                                const std::string& extension,
                                                std::span<const std::string> names) {
  std::vector<FinishedObject<Dim>> out;
  for (const Result<Dim>* result : results) {
    FinishedObject<Dim> object;
    try {
      object.finished = beside_others<Dim>(setting, *result, out, extension, names, object);
    } catch (const NoObject&) {
      object.failure = std::current_exception();
    } catch (const InvalidMesh&) {
      object.failure = std::current_exception();
    }
    out.push_back(std::move(object));
  }
  return out;
}

template <int Dim>
std::vector<std::uint8_t> label_map(const Setting<Dim>& setting, const ImageBox<Dim>& grid,
                                    std::span<const FinishedObject<Dim>> objects) {
  if (objects.size() > std::numeric_limits<std::uint8_t>::max())
    throw UsageError(
        fmt::format("label map: {} objects; at most 255 have a label", objects.size()));
  std::vector<std::uint8_t> out;
  const auto cells_in = [&](const Simplices<Dim>& shape) {
    return setting.rasterized(shape, grid.size, grid.index_to_world);
  };
  std::size_t n_cells = 1;
  for (const int along : grid.size) n_cells *= std::size_t(along);
  out.assign(n_cells, 0);
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (!objects[n].finished) continue;
    const std::vector<std::uint8_t> is_inside = cells_in(objects[n].finished->shape);
    for (std::size_t at = 0; at < n_cells; ++at)
      if (is_inside[at]) out[at] = std::uint8_t(n + 1);
  }
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (objects[n].whole.elements.rows() == 0) continue;
    const std::vector<std::uint8_t> was_inside = cells_in(objects[n].whole);
    std::vector<std::function<double(const Vector<Dim>&)>> distances;
    for (const Wall& wall : objects[n].walls)
      distances.push_back(setting.distance_to(objects[wall.other].finished->shape));
    for (std::size_t at = 0; at < n_cells; ++at) {
      if (!was_inside[at] || out[at] != 0) continue;
      Vector<Dim> index;
      std::size_t rest = at;
      for (int axis = 0; axis < Dim; ++axis) {
        index[axis] = double(rest % std::size_t(grid.size[axis]));
        rest /= std::size_t(grid.size[axis]);
      }
      const Vector<Dim> center = grid.index_to_world * index;
      if (std::any_of(distances.begin(), distances.end(), [&](const auto& distance) {
            return distance(center) <= kMostGapOfWalls * setting.extent().cell_mm();
          }))
        out[at] = std::uint8_t(n + 1);
    }
  }
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template std::vector<FinishedObject<Dim>> finish_objects<Dim>(                               \
      const Setting<Dim>&, std::span<const Result<Dim>* const>, const std::string&,            \
      std::span<const std::string>);                                                           \
  template std::vector<std::uint8_t> label_map<Dim>(const Setting<Dim>&, const ImageBox<Dim>&, \
                                                    std::span<const FinishedObject<Dim>>);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
