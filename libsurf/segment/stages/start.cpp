#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "libsurf/fem/geometry.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/segment/detail/edges_along.h"
#include "libsurf/segment/detail/point_text.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/segment/stages/size.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

// Of the image's range, since phantoms have no noise: what a curve or surface can grow through.
constexpr double kLeastDeviation = 1.0 / 256;
constexpr double kSigma = 0.7, kEdgeLength = 1.5;  // cells
// Curves jump over no edge (MovingShapeOptions::edge_indicator): only edges that are wider [cells]
// ask for other lengths than those of a pixel.
constexpr double kWideInThePlane = 1.5;
constexpr double kShareOfStart = 1.0 / 3;            // of the radius of a given start
constexpr double kLeastRadius = 2, kMostRadius = 8;  // cells, of a seed ball
// Of wide edges a larger one: of so many deviations of their blur, as far as there is room for it.
// A force that makes it grow is no stronger then than what holds it at the edges, see the balloon
// of minimal-surface.
constexpr double kBlurs = 4, kShareOfNearest = 0.6, kShareBetween = 0.4;

template <int Dim>
double measure_of_ball(double radius) {
  return Dim == 3 ? 4 * std::numbers::pi * radius * radius : 2 * std::numbers::pi * radius;
}

template <int Dim>
double least_distance(const std::vector<Vector<Dim>>& points) {
  double out = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < points.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (const double distance = (points[a] - points[b]).norm(); distance > 0)
        out = std::min(out, distance);
  return out;
}

/// Seed balls as one shape of several components; where they may not merge, a ball that would
/// touch an earlier one is left out.
template <int Dim>
Simplices<Dim> seed_balls(Work<Dim>& work) {
  const double radius = work.seed_radius_mm, edge = std::min(work.edge_length_mm, radius / 2);
  const double least = work.options.topology == mesh::Topology::kFixed
                           ? 2 * radius + edge
                           : edge / 4;  // the same place
  std::vector<Simplices<Dim>> balls;
  std::vector<Vector<Dim>> used;
  for (const Vector<Dim>& seed : work.seeds_mm) {
    if (std::any_of(used.begin(), used.end(),
                    [&](const Vector<Dim>& other) { return (other - seed).norm() < least; })) {
      work.notes.push_back(
          fmt::format("the ball round seed ({}) would touch another one and is left out",
                      point_text<Dim>(seed)));
      continue;
    }
    used.push_back(seed);
    check_elements<Dim>("start", measure_of_ball<Dim>(radius), edge, edge);
    balls.push_back(work.setting().ball(seed, radius, edge));
  }
  return work.setting().joined(balls);
}

/// Its centre if it holds that, else places some cells in from vertices, as in a ring.
template <int Dim>
std::vector<Vector<Dim>> points_in(const Simplices<Dim>& shape, double cell_mm) {
  constexpr Eigen::Index kMost = 32;
  constexpr double kDepth = 2;  // cells
  const Points<Dim> centre = shape.points.colwise().mean();
  if (mesh::are_inside<Dim>(shape, centre).front()) return {Vector<Dim>(centre.row(0).transpose())};
  const fem::Geometry<Dim> geometry(shape.points, shape.elements);
  const Eigen::Index n = std::min(kMost, shape.points.rows());
  Points<Dim> places(n, Dim);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index vertex = i * shape.points.rows() / n;
    places.row(i) = shape.points.row(vertex) -
                    kDepth * cell_mm * geometry.nodal_normals().row(vertex).normalized();
  }
  const std::vector<char> flags = mesh::are_inside<Dim>(shape, places);
  std::vector<Vector<Dim>> out;
  for (Eigen::Index i = 0; i < n; ++i)
    if (flags[std::size_t(i)]) out.push_back(places.row(i).transpose());
  if (out.empty()) out.push_back(centre.row(0).transpose());
  return out;
}

template <int Dim>
class Start : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const Options<Dim>& options = work.options;
    const double cell = work.cell_mm();
    EdgesAlong edges;
    edges.sigma_mm = options.sigma_mm.value_or(kSigma * cell);
    if (!work.seeds_mm.empty()) {
      const EdgesAlong seen = edges_round<Dim>(work.fields, options, work.seeds_mm);
      if (Dim == 3 || seen.blur_mm > kWideInThePlane * cell) edges = seen;
    }
    const double widest = std::max(cell, edges.blur_mm);
    work.sigma_mm = edges.sigma_mm;
    work.whole_blur_mm = std::hypot(edges.blur_mm, blur_mm(edges.sigma_mm, cell));
    work.edge_length_mm = options.edge_length_mm.value_or(kEdgeLength * edge_scale(work, widest));
    work.geometry_tolerance_mm = options.geometry_tolerance_mm.value_or(widest);
    const auto model = work.fields.model(field_options(options, work.sigma_mm));
    if (!work.seeds_mm.empty())
      work.seed = seed_model(work, *model, work.seeds_mm);
    else if (work.shape.points.rows() > 0)
      work.seed = seed_model(work, *model, points_in<Dim>(work.shape, work.cell_mm()));
    work.seed_radius_mm = options.seed_radius_mm.value_or(
        std::max(std::clamp(0.7 * work.seed.radius_mm, kLeastRadius * cell, kMostRadius * cell),
                 std::min({kBlurs * edges.blur_mm, kShareOfNearest * edges.nearest_mm,
                           kShareBetween * least_distance(work.seeds_mm)})));
    // Longer ones would make it vanish at the first step.
    if (!work.start_is_given && !options.edge_length_mm)
      work.edge_length_mm =
          std::min(work.edge_length_mm, std::max(kEdgeLength * cell, work.seed_radius_mm));
    work.shape = work.start_is_given ? work.setting().in_file_order(work.shape) : seed_balls(work);
    work.start = work.shape;
    work.energies = completed<Dim>(options.energies, context(work, *model));
    if (!work.is_stopped()) return true;
    StageReport report;
    report.name = "start";
    report.kind = StageKind::kProposes;
    report.outcome = Outcome::kStopped;
    report.message = "interrupted before the first step";
    work.reports.push_back(std::move(report));
    return false;
  }

 private:
  /// Wide edges ask for no finer elements, but a small start does. [mm]
  static double edge_scale(const Work<Dim>& work, double widest) {
    if (!work.start_is_given) return widest;
    const fem::Geometry<Dim> start(work.shape.points, work.shape.elements);
    return std::min(widest, std::max(work.cell_mm(), kShareOfStart * start.radius()));
  }

  static SeedModel seed_model(const Work<Dim>& work, const EnergyModel<Dim>& model,
                              const std::vector<Vector<Dim>>& seeds) {
    SeedModel out = estimate_seed_model<Dim>(*model.intensity(), seeds, work.setting().extent());
    out.deviation = std::max(out.deviation, kLeastDeviation * work.setting().extent().width());
    return out;
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> start_stage() {
  return std::make_unique<Start<Dim>>();
}

template StagePointer<2> start_stage<2>();
template StagePointer<3> start_stage<3>();

}  // namespace surf::segment
