#include <chrono>

#include "libsurf/segment/edge_offset.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kFurthest = 0.25;  // cells

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

/// moved_to_edge() by the last energy that was minimised.
template <int Dim>
class Offset : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const auto begin = std::chrono::steady_clock::now();
    const StageReport& last = work.reports.back();
    const auto model = work.fields.model(field_options(work.options, last.sigma_mm));
    const auto energy = make_energy<Dim>(last.energies, context(work, *model));
    StageReport report;
    report.name = "offset";
    report.kind = StageKind::kCorrects;
    report.message = "the bias of the curvature is taken off";
    report.energies = last.energies;
    report.sigma_mm = last.sigma_mm;
    report.edge_length_mm = last.edge_length_mm;
    work.shape =
        moved(work, moved_to_edge<Dim>(work.shape, *energy, blur_mm(last.sigma_mm, work.cell_mm()),
                                       kFurthest * work.cell_mm()));
    report.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    work.reports.push_back(std::move(report));
    return true;
  }

 private:
  /// Past no click that the shape obeys.
  static Simplices<Dim> moved(const Work<Dim>& work, Points<Dim> to) {
    const Simplices<Dim>& from = work.shape;
    const ImageExtent<Dim>& extent = work.setting().extent();
    const double distance = held_distance_mm(work.cell_mm());
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
};

}  // namespace

template <int Dim>
StagePointer<Dim> offset_stage() {
  return std::make_unique<Offset<Dim>>();
}

template StagePointer<2> offset_stage<2>();
template StagePointer<3> offset_stage<3>();

}  // namespace surf::segment
