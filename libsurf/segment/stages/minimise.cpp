#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>

#include "libsurf/segment/certainty.h"
#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/rest.h"
#include "libsurf/segment/stages/size.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

// Of a step, by the deviation of the blur: an edge is about three times as wide.
constexpr double kStepPerBlur = 1.2;
// As many times that for curves, but for windows: regions compete wherever the curve is, and edges
// that a node would jump over are looked for. Twelve noisy discs with chan-vese and area take 96
// steps, not 160; the blob of docs/curves-program.md with minimal-surface 39, not 120. For surfaces
// that edges attract, too: a ball of 256^3 with minimal-surface takes 27 steps, not 70. (With
// chan-vese a noisy box is 0.150 voxel off, not 0.141; fitted energies are near the edges anyway.)
constexpr double kLongSteps = 4;
constexpr double kHeldCells = 0.51;  // round a click: half a cell, whatever is rounded
// Of a fitted energy: near its minimum nearly all vertices take the whole step of the inexact
// Newton method. The inside of a skull (45,000 triangles) takes 28 steps, not 64, the brain 18, not
// 37, with the same errors to 0.001 voxel on phantoms and 0.0005 in Dice on scans.
constexpr double kFittedShare = 1e-3;  // of the area, as StepOptions::exempt_share
constexpr int kFittedWindow = 4;       // steps
constexpr double kAtRest = 0.02;       // cells: no vertex moved further in any step of the window
constexpr const char* kAllStays = "nothing is left that was to move: all of it stays as it was";

template <class Call>
std::exception_ptr thrown_by(const Call& call) {
  try {
    call();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

/// That of the shape which was amended, if there is one and no vertex of another is left.
/// @return  false: edges have to be located
template <int Dim>
bool keep_certainty(Work<Dim>& work) {
  if (!work.settled) return false;
  const Simplices<Dim>& known = work.settled->shape;
  const std::vector<char> are_known = are_vertices_of<Dim>(known, work.shape);
  if (std::find(are_known.begin(), are_known.end(), 0) != are_known.end()) return false;
  if (work.settled->certainty)
    work.certainty = certainty_of_part<Dim>(*work.settled->certainty, known, work.shape);
  return true;
}

template <int Dim>
void lengthen_steps(const std::vector<EnergyTerm>& terms, const KindContext<Dim>& kind_context,
                    mesh::MovingShapeOptions<Dim>& shape) {
  if (!take_long_steps<Dim>(terms)) return;
  const auto edges = edge_field<Dim>(terms, kind_context);
  if (Dim == 3 && (!edges || are_fitted<Dim>(terms))) return;
  shape.edge_indicator = edges;
  shape.path_spacing_mm = shape.max_displacement_mm;
  shape.max_displacement_mm *= kLongSteps;
}

}  // namespace

template <int Dim>
FieldOptions field_options(const Options<Dim>& options, double sigma_mm) {
  FieldOptions out;
  out.smoothing.sigma_mm = sigma_mm;
  out.smoothing.selective_sigma_mm = options.selective_sigma_mm;
  out.smoothing.selective_threshold = options.selective_threshold;
  out.filter = options.derivative_filter;
  out.interpolation = options.interpolation;
  return out;
}

template <int Dim>
KindContext<Dim> context(const Work<Dim>& work, EnergyModel<Dim>& model) {
  KindContext<Dim> out{.model = model};
  out.setting = &work.setting();
  out.seeds_mm = work.seeds_mm;
  if (out.seeds_mm.empty() && work.start.points.rows() > 0)
    out.seeds_mm.push_back(work.start.points.colwise().mean().transpose());
  out.seed = work.seed;
  out.seed_radius_mm = work.seed_radius_mm;
  out.edge_blur_mm = work.whole_blur_mm;
  out.initial = work.start_is_given ? &work.start : nullptr;
  out.region = work.region.get();
  return out;
}

double blur_mm(double sigma_mm, double cell_mm) {
  return std::sqrt(sigma_mm * sigma_mm + cell_mm * cell_mm / 3);
}

template <int Dim>
mesh::MovingShapeOptions<Dim> shape_options(const Work<Dim>& work, double edge_length_mm,
                                            double sigma_mm) {
  const Options<Dim>& options = work.options;
  mesh::MovingShapeOptions<Dim> out;
  out.edge_length_mm = edge_length_mm;
  out.coarseness = options.coarseness;
  out.adaptivity.geometry_tolerance_mm = work.geometry_tolerance_mm;
  out.adaptivity.integral_tolerance = options.integral_tolerance;
  out.adaptivity.gamma_refine = options.gamma_refine;
  out.adaptivity.gamma_coarsen = options.gamma_coarsen;
  out.topology = options.topology;
  out.topology_resolution_mm = options.topology_resolution_mm.value_or(0);
  if (options.sheet_distance_mm) out.sheet_distance = *options.sheet_distance_mm / edge_length_mm;
  out.max_displacement_mm = kStepPerBlur * blur_mm(sigma_mm, work.cell_mm());
  out.held_points = held_points<Dim>(work.clicks);
  out.held_distance_mm = held_distance_mm(work.cell_mm());
  return out;
}

double held_distance_mm(double cell_mm) { return kHeldCells * cell_mm; }

template <int Dim>
bool begins(Work<Dim>& work, const char* name, std::string message) {
  StageReport report;
  report.name = name;
  report.kind = StageKind::kProposes;
  report.outcome = work.is_stopped() ? Outcome::kStopped : Outcome::kProposed;
  report.message = std::move(message);
  report.sigma_mm = work.sigma_mm;
  report.edge_length_mm = work.edge_length_mm;
  work.reports.push_back(std::move(report));
  return !work.is_stopped();
}

template <int Dim>
bool minimise(Work<Dim>& work, const Minimisation<Dim>& minimisation) {
  work.energy.reset();
  const auto model = work.fields.model(field_options(work.options, minimisation.sigma_mm));
  const std::vector<EnergyTerm>& terms = minimisation.terms;
  mesh::MovingShapeOptions<Dim> options = minimisation.shape;
  options.adaptivity.integrands = integrands<Dim>(terms, context(work, *model));
  if (minimisation.may_take_long_steps) lengthen_steps<Dim>(terms, context(work, *model), options);
  StageReport report;
  report.name = minimisation.name;
  report.energies = terms;
  report.sigma_mm = minimisation.sigma_mm;
  report.edge_length_mm = options.edge_length_mm;
  check_elements<Dim>(report.name.c_str(),
                      fem::Geometry<Dim>(work.shape.points, work.shape.elements).measure(),
                      options.edge_length_mm, options.coarseness * options.edge_length_mm);
  options.region = work.region;
  options.stop = work.stop;
  // The first mending has one thread for much of its time; the fields need not wait for it. What
  // either throws must not cancel the other, whose fields are kept, and the mending's comes first.
  std::unique_ptr<mesh::MovingMesh<Dim>> shape;
  std::shared_ptr<energy::EnergySum<Dim>> energy;
  std::exception_ptr no_shape, no_energy;
  tbb::parallel_invoke(
      [&] {
        no_shape = thrown_by([&] { shape = work.setting().make_shape(work.shape, options); });
      },
      [&] {
        if (work.is_stopped()) return;
        no_energy = thrown_by([&] { energy = make_energy<Dim>(terms, context(work, *model)); });
      });
  if (no_shape) std::rethrow_exception(no_shape);
  if (work.is_stopped()) {
    report.outcome = Outcome::kStopped;
    report.message = "interrupted before the first step";
    work.reports.push_back(std::move(report));
    return false;
  }
  if (no_energy) std::rethrow_exception(no_energy);
  flow::FlowOptions flow = minimisation.flow;
  flow.stop = work.stop;
  if (flow.keeps_content() && !flow.content) {  // that of the start, whatever a stage has changed
    if (work.kept_content)
      flow.content = work.kept_content;
    else
      work.kept_content = shape->geometry().enclosed();
  }
  const bool is_fitted = are_fitted<Dim>(terms);
  const bool may_rest = is_fitted && !flow.step.tau_max;  // steps that are cut say nothing of rest
  if (may_rest)
    flow.displacement_tol_mm = std::max(flow.displacement_tol_mm, kAtRest * work.cell_mm());
  if (is_fitted) {
    if (flow.method == flow::Method::kGradientFlow) flow.step.bound = flow::StepBound::kVertex;
    flow.step.exempt_share = std::max(flow.step.exempt_share, kFittedShare);
    flow.energy_window = std::min(flow.energy_window, kFittedWindow);
  }
  if (shape->rests()) flow.max_steps = 0;
  RestRule<Dim> rest(work.setting(), shape->geometry().measure(), flow.energy_window,
                     work.region.get());
  std::string at_rest;
  const auto shape_now = [&] { return shape->simplices(); };
  const auto on_step = [&](const flow::StepRecord& record) {
    if (may_rest) at_rest = rest.check(record.k, record.energy, shape_now);
    if (minimisation.ends && at_rest.empty()) at_rest = minimisation.ends(record);
    if (shape->rests()) at_rest = kAllStays;
    work.border_share = shape->border_share();
    return work.tell(report.name, record, shape_now) && at_rest.empty();
  };
  report.flow = flow::evolve<Dim>(*shape, *energy, flow, on_step);
  if (shape->rests()) at_rest = kAllStays;
  // Without a step there is nothing to be told of, and nothing that a stop could cut short.
  if (!at_rest.empty() && (!work.is_stopped() || report.flow.steps.empty())) {
    report.flow.termination = flow::Termination::kConverged;
    report.flow.message = at_rest;
  }
  work.shape = shape->simplices();
  report.outcome = shape->has_vanished() ? Outcome::kVanished : outcome_of(report.flow.termination);
  report.message = report.flow.message;
  work.border_share = shape->border_share();
  if (shape->is_limited())
    work.notes.push_back(fmt::format(
        "{}: the {} is coarser than asked for: at {} elements nothing is refined any more",
        report.name, work.setting().noun(), options.adaptivity.max_elements));
  work.reports.push_back(std::move(report));
  work.energy = std::move(energy);
  if (work.told) work.told->n_notes = work.notes.size();  // this stage is done
  if (shape->rests() && keep_certainty(work)) return false;
  return work.reports.back().outcome == Outcome::kConverged;
}

template FieldOptions field_options<2>(const Options<2>&, double);
template FieldOptions field_options<3>(const Options<3>&, double);
template KindContext<2> context<2>(const Work<2>&, EnergyModel<2>&);
template KindContext<3> context<3>(const Work<3>&, EnergyModel<3>&);
template mesh::MovingShapeOptions<2> shape_options<2>(const Work<2>&, double, double);
template mesh::MovingShapeOptions<3> shape_options<3>(const Work<3>&, double, double);
template bool begins<2>(Work<2>&, const char*, std::string);
template bool begins<3>(Work<3>&, const char*, std::string);
template bool minimise<2>(Work<2>&, const Minimisation<2>&);
template bool minimise<3>(Work<3>&, const Minimisation<3>&);

}  // namespace surf::segment
