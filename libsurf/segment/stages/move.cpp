
#include <fmt/format.h>

#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

/// The clicks that the shape has where they belong.
template <int Dim>
std::vector<mesh::HeldPoint<Dim>> obeyed(const Simplices<Dim>& shape,
                                         const std::vector<Click<Dim>>& clicks, double distance_mm,
                                         const ImageExtent<Dim>& extent) {
  const std::vector<mesh::HeldPoint<Dim>> all = held_points<Dim>(clicks);
  const std::vector<char> flags = mesh::are_held<Dim>(shape, all, distance_mm, extent);
  std::vector<mesh::HeldPoint<Dim>> out;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (flags[k]) out.push_back(all[k]);
  return out;
}

}  // namespace

template <int Dim>
bool CorrectingStage<Dim>::run(Work<Dim>& work) const {
  const StageReport& last = work.reports.back();
  StageReport report;
  report.name = name();
  report.kind = StageKind::kCorrects;
  report.energies = last.energies;
  report.sigma_mm = last.sigma_mm;
  report.edge_length_mm = last.edge_length_mm;
  if (!work.is_stopped()) report.message = correct(work);
  const bool was_stopped = report.message.empty();
  if (was_stopped) {
    report.outcome = Outcome::kStopped;
    report.message = fmt::format("interrupted before the {} was corrected", work.setting().noun());
  }
  work.reports.push_back(std::move(report));
  return !was_stopped;
}

template <int Dim>
Simplices<Dim> moved_past_clicks(const Work<Dim>& work, Points<Dim> to) {
  const Simplices<Dim>& from = work.shape;
  const ImageExtent<Dim>& extent = work.setting().extent();
  const double distance = held_distance_mm(work.cell_mm());
  for (Eigen::Index i = 0; work.region && i < to.rows(); ++i)
    if (!work.region->contains(from.points.row(i).transpose())) to.row(i) = from.points.row(i);
  std::vector<Vector<Dim>> points;
  for (const mesh::HeldPoint<Dim>& held : obeyed<Dim>(from, work.clicks, distance, extent))
    points.push_back(held.point);
  const mesh::PointObstacles<Dim> obstacles(std::move(points), distance, extent);
  obstacles.limit(from.points, from.elements, to);
  const Points<Dim> limited = to;
  Simplices<Dim> out = work.setting().moved(from, to);
  while (obstacles.hold(from.points, limited, from.elements, out.points) > 0)
    out = work.setting().moved(from, out.points);
  return out;
}

template class CorrectingStage<2>;
template class CorrectingStage<3>;
template Segments moved_past_clicks<2>(const Work<2>&, Points<2>);
template Triangles moved_past_clicks<3>(const Work<3>&, Points<3>);

}  // namespace surf::segment
