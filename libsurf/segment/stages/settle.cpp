#include <algorithm>

#include "libsurf/segment/seed_model.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

// What lies on a weak edge shall stay about where it is: an energy of edges alone has its minimum
// elsewhere.
constexpr int kMostSteps = 8;
constexpr double kLongestStep = 0.25;  // cells, or deviations of the blur of wider edges

/// Half the median |grad I| on the shape: edges found so far are strong, noise is not.
template <int Dim>
double edge_strength_on(const Simplices<Dim>& shape, const EnergyModel<Dim>& model) {
  Samples<Dim> samples;
  model.intensity()->sample(shape.points, Derivatives::kFirst, samples);
  std::vector<double> gradients;
  for (Eigen::Index i = 0; i < samples.gradient.rows(); ++i)
    gradients.push_back(samples.gradient.row(i).norm());
  return 0.5 * median(std::move(gradients));
}

/// At most kMostSteps small steps of int H dS from what explicit energies have found.
template <int Dim>
class Settle : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const auto model = work.fields.model(field_options(work.options, work.sigma_mm));
    const std::optional<double> known = edge_strength<Dim>(work.energies);
    const double lambda = known ? *known : edge_strength_on<Dim>(work.shape, *model);
    if (!(lambda > 0)) return true;
    Minimisation<Dim> out;
    out.name = "settle";
    out.terms = {{"minimal-surface", 1, {{"gamma0", 1}, {"gamma", 0}, {"lambda", lambda}}}};
    out.sigma_mm = work.sigma_mm;
    out.flow = work.options.flow;
    out.flow.max_steps = std::min(out.flow.max_steps, kMostSteps);
    out.shape = shape_options(work, work.edge_length_mm, work.sigma_mm);
    out.shape.max_displacement_mm = kLongestStep * std::max(work.cell_mm(), work.whole_blur_mm);
    out.may_take_long_steps = Dim == 2;  // what lies on a weak edge stays about where it is
    minimise(work, out);
    StageReport& report = work.reports.back();
    report.kind = StageKind::kCorrects;
    return report.outcome == Outcome::kConverged ||
           report.flow.termination == flow::Termination::kMaxSteps;
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> settle_stage() {
  return std::make_unique<Settle<Dim>>();
}

template StagePointer<2> settle_stage<2>();
template StagePointer<3> settle_stage<3>();

}  // namespace surf::segment
