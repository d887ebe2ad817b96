#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/mesh/shape_part.h"
#include "libsurf/segment/detail/edges_along.h"
#include "libsurf/segment/detail/locate_edges.h"
#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr int kRings = 2;           // of elements, whose edges tell those that move where to go
constexpr double kLookCells = 2.5;  // from the shape: the edges whose blur is taken

/// What of the shape moves, and what mending has changed beside it, with two rings round it; all of
/// it without a region.
template <int Dim>
mesh::ShapePart<Dim> part_to_locate(const Work<Dim>& work) {
  const Simplices<Dim>& shape = work.shape;
  if (!work.region) return mesh::part_of<Dim>(shape, {});
  const std::vector<char> is_known = are_vertices_of<Dim>(work.settled->shape, shape);
  std::vector<char> is_left_out;
  for (const auto& t : shape.elements.rowwise())
    is_left_out.push_back(std::none_of(t.begin(), t.end(), [&](int i) {
      return !is_known[std::size_t(i)] || work.region->contains(shape.points.row(i).transpose());
    }));
  for (int ring = 0; ring < kRings; ++ring)
    is_left_out = mesh::without_neighbours<Dim>(shape.elements, std::move(is_left_out));
  return mesh::part_of<Dim>(shape, is_left_out);
}

/// Taken again along a shape that has moved a little it jumps from one scale to another: so along
/// the start, if the energy was fitted to it.
template <int Dim>
double edge_blur_mm(Work<Dim>& work) {
  if (work.edge_blur_mm > 0) return work.edge_blur_mm;
  if (work.start_is_given && are_fitted<Dim>(work.energies)) return edges_along_start(work).blur_mm;
  return edges_along<Dim>(work.fields, work.options, work.shape, kLookCells * work.cell_mm())
      .blur_mm;
}

/// locate_edges() from the shape of the minimiser, or of the part of it that has moved.
template <int Dim>
class Locate : public CorrectingStage<Dim> {
  const char* name() const override { return "locate"; }

  std::string correct(Work<Dim>& work) const override {
    const double blur = edge_blur_mm(work);
    const bool has_known = work.settled && work.settled->certainty;
    const mesh::ShapePart<Dim> part =
        has_known ? part_to_locate(work) : mesh::part_of<Dim>(work.shape, {});
    if (part.elements.empty()) return "nothing has moved";
    const bool is_whole = part.shape.elements.rows() == work.shape.elements.rows();
    LocatedEdges<Dim> located =
        locate_edges<Dim>(work.setting(), part.shape, blur,
                          is_whole ? std::vector<char>() : part.is_shared, work.stop);
    if (located.was_stopped) return "";
    Points<Dim> to = work.shape.points;
    to(part.vertices, Eigen::all) = located.points;
    work.shape = moved_past_clicks<Dim>(work, to);
    // What could not go where it belongs is that much less sure.
    for (std::size_t n = 0; n < part.vertices.size(); ++n) {
      const int i = part.vertices[n];
      double& deviation = located.certainty.deviation_mm[Eigen::Index(n)];
      deviation = std::hypot(deviation, (work.shape.points.row(i) - to.row(i)).norm());
    }
    work.certainty = is_whole
                         ? std::move(located.certainty)
                         : amended_certainty<Dim>(*work.settled->certainty, work.settled->shape,
                                                  located.certainty, part, work.shape);
    return fmt::format(
        "steps of width {:.3g} mm under noise of {:.3g}; smooth below {:.3g} mm; {:.3g} % of the "
        "{} has no edge",
        located.blur_mm, located.noise, located.length_mm, 100 * work.certainty->share_without_edge,
        work.setting().noun());
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> locate_stage() {
  return std::make_unique<Locate<Dim>>();
}

template StagePointer<2> locate_stage<2>();
template StagePointer<3> locate_stage<3>();

}  // namespace surf::segment
