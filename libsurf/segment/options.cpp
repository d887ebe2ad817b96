#include "libsurf/segment/options.h"

#include <fmt/format.h>

namespace surf::segment {

std::string ComponentOptions::error() const {
  if (!(min_content >= 0))
    return fmt::format("Options::components.min_content = {} violates >= 0", min_content);
  return {};
}

template <int Dim>
std::string Options<Dim>::error() const {
  const auto positive = [](const std::optional<double>& value, const char* name) -> std::string {
    return value && !(*value > 0) ? fmt::format("Options::{} = {} violates > 0", name, *value) : "";
  };
  for (const auto& [value, name] : {std::pair{seed_radius_mm, "seed_radius_mm"},
                                    {edge_length_mm, "edge_length_mm"},
                                    {geometry_tolerance_mm, "geometry_tolerance_mm"},
                                    {topology_resolution_mm, "topology_resolution_mm"},
                                    {sheet_distance_mm, "sheet_distance_mm"}})
    if (std::string error = positive(value, name); !error.empty()) return error;
  if (sigma_mm && !(*sigma_mm >= 0))
    return fmt::format("Options::sigma_mm = {} violates >= 0", *sigma_mm);
  if (n_levels < 1 || n_levels > 6)
    return fmt::format("Options::n_levels = {} violates 1 to 6", n_levels);
  if (n_coarse_steps < 0)
    return fmt::format("Options::n_coarse_steps = {} violates >= 0", n_coarse_steps);
  for (const auto& [value, name] :
       {std::pair{coarse_geometry, "coarse_geometry"}, {continued_geometry, "continued_geometry"}})
    if (!(value >= 1 && std::isfinite(value)))
      return fmt::format("Options::{} = {} violates >= 1", name, value);
  if (!(first_threshold > 0 && first_threshold <= second_threshold &&
        std::isfinite(second_threshold)))
    return fmt::format(
        "Options::first_threshold = {}, second_threshold = {} violate 0 < first <= second",
        first_threshold, second_threshold);
  if (!(gamma_coarsen >= 0 && gamma_coarsen < gamma_refine && gamma_refine <= 1))
    return fmt::format(
        "Options::gamma_refine = {}, gamma_coarsen = {} violate 0 <= gamma_coarsen < gamma_refine "
        "<= 1",
        gamma_refine, gamma_coarsen);
  if (!(coarseness >= 1)) return fmt::format("Options::coarseness = {} violates >= 1", coarseness);
  if (!(integral_tolerance >= 0))
    return fmt::format("Options::integral_tolerance = {} violates >= 0", integral_tolerance);
  if (Dim == 3 && interpolation != volume::Interpolation::kSpline)
    return "Options::interpolation: volumes are interpolated by splines";
  if (Dim == 2 && topology == mesh::Topology::kGenus0)
    return "Options::topology = genus0 has no meaning for curves";
  if (std::string error = components.error(); !error.empty()) return error;
  return flow.error();
}

template struct Options<2>;
template struct Options<3>;

}  // namespace surf::segment
