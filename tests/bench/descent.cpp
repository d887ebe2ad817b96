#include "tests/bench/descent.h"

#include <chrono>
#include <cmath>

#include "libsurf/energy/energy_sum.h"

namespace surf::bench {

Descended descend(const Segments& start, const Descent& descent, const EachStep& each_step) {
  const auto begin = std::chrono::steady_clock::now();
  energy::EnergySum<2> energy;
  energy::DomainIntegralOptions domain;
  domain.ray_spacing_mm = descent.ray_spacing_mm;
  energy::add_minimal_surface<2>(energy, descent.H, descent.gamma_0, descent.gamma, domain);
  curve::MovingCurve moving(start, descent.curves);
  flow::FlowOptions flow;
  flow.velocity.product = descent.product;
  flow.velocity.scheme = descent.product == flow::ScalarProduct::kL2 ? flow::Scheme::kSemiImplicit
                                                                     : flow::Scheme::kExplicit;
  flow.velocity.beta_floor = descent.beta_floor;
  flow.max_steps = descent.max_steps;
  flow.rel_tol = 0;
  flow.energy_tol = 0;
  Descended out;
  bool has_converged = false;
  const auto summary = flow::evolve<2>(moving, energy, flow, [&](const flow::StepRecord& record) {
    out.n_trials += record.n_trials;
    if (each_step) each_step(record, moving.simplices());
    has_converged = std::abs(record.shape_derivative) <= descent.tolerance;
    return !has_converged;
  });
  out.curves = moving.simplices();
  out.n_steps = static_cast<int>(summary.steps.size());
  out.J_first = summary.initial_energy;
  energy.reset(moving.geometry());
  out.J_last = energy.value();
  out.stop = has_converged ? "converged" : flow::to_string(summary.termination);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

}  // namespace surf::bench
