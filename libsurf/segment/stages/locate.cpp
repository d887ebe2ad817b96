#include <fmt/format.h>

#include <cmath>

#include "libsurf/segment/edges_along.h"
#include "libsurf/segment/locate_edges.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kLookCells = 2.5;  // from the shape: the edges whose blur is taken

/// locate_edges() from the shape of the minimiser.
template <int Dim>
class Locate : public CorrectingStage<Dim> {
  const char* name() const override { return "locate"; }

  std::string correct(Work<Dim>& work) const override {
    const double cell = work.cell_mm();
    // Taken again along a shape that has moved a little it jumps from one scale to another.
    const double blur =
        work.edge_blur_mm > 0
            ? work.edge_blur_mm
            : edges_along<Dim>(work.fields, work.options, work.shape, kLookCells * cell).blur_mm;
    LocatedEdges<Dim> located = locate_edges<Dim>(work.setting(), work.shape, blur);
    const Simplices<Dim> moved = moved_past_clicks<Dim>(work, located.points);
    const Points<Dim>& to = located.points;
    // What could not go where it belongs is that much less sure.
    for (Eigen::Index i = 0; i < to.rows(); ++i)
      located.certainty.deviation_mm[i] =
          std::hypot(located.certainty.deviation_mm[i], (moved.points.row(i) - to.row(i)).norm());
    work.shape = moved;
    work.certainty = std::move(located.certainty);
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
