#include "tools/common/field_names.h"

#include <cctype>
#include <map>

namespace surfseg {
namespace {

const std::map<std::string, std::string>& option_names() {
  static const std::map<std::string, std::string> names = {
      {"Object::name", "--object"},
      {"Object::clicks", "--seed, --outside"},
      {"Options::seeds_mm", "--seed"},
      {"Options::outside_mm", "--outside"},
      {"Options::box_mm", "--box"},
      {"Options::samples_mm", "--initial"},
      {"Options::seed_radius_mm", "--radius"},
      {"Options::initial", "--initial"},
      {"Options::energies", "--energy"},
      {"Options::sigma_mm", "--sigma"},
      {"Options::selective_sigma_mm", "--selective-sigma"},
      {"Options::selective_threshold", "--selective-threshold"},
      {"Options::derivative_filter", "--derivatives"},
      {"Options::edge_length_mm", "--edge-length"},
      {"Options::coarseness", "--coarseness"},
      {"Options::geometry_tolerance_mm", "--geometry-tolerance"},
      {"Options::integral_tolerance", "--integral-tolerance"},
      {"Options::gamma_refine", "--gamma-refine"},
      {"Options::n_coarse_steps", "--coarse-steps"},
      {"Options::coarse_geometry", "--coarse-geometry"},
      {"Options::continued_geometry", "--continued-geometry"},
      {"Options::first_threshold", "--first-threshold"},
      {"StepOptions::alpha", "--alpha"},
      {"StepOptions::epsilon_tau", "--epsilon-tau"},
      {"StepOptions::tau_min", "--tau-min"},
      {"StepOptions::tau_max", "--tau-max"},
      {"Options::topology", "--topology"},
      {"Options::topology_resolution_mm", "--topology-resolution"},
      {"Options::sheet_distance_mm", "--sheet-distance"},
      {"Options::open_cavities", "--open-cavities"},
      {"Options::n_levels", "--levels"},
      {"Options::settle", "--no-settle"},
      {"Options::locate", "--locate"},
      {"Click::point_mm", "--seed"},
      {"Click::point_mm[outside]", "--outside"},
      {"Click::side", "--outside"},
      {"Options::interpolation", "--sampling"},
      {"SmoothingOptions::sigma_mm", "--sigma"},
      {"SmoothingOptions::selective_sigma_mm", "--selective-sigma"},
      {"SmoothingOptions::selective_threshold", "--selective-threshold"},
      {"FlowOptions::max_steps", "--max-iterations"},
      {"FlowOptions::rel_tol", "--tolerance"},
      {"FlowOptions::method", "--flow"},
      {"FlowOptions::velocity.product", "--flow"},
      {"FlowOptions::velocity.scheme", "--scheme"},
      {"FlowOptions::step.rule", "--step-rule"},
      {"FlowOptions::content", "--volume"},
      {"FlowOptions::keep_content", "--volume"},
      {"Options::components.min_content", "--min-component"},
      {"RegionFilter::min_area_mm2", "--min-component"},
      {"SeedGridOptions::spacing_mm", "--seeds-grid"},
      {"SeedGridOptions::radius_mm", "--radius"},
      {"SeedGridOptions::are_dark", "--dark"},
      {"ReadOptions::frame_index", "--frame-index"},
      {"ReadOptions::series_uid", "--series-uid"},
      {"PhantomOptions::size", "--size"},
      {"PhantomOptions::spacing_mm", "--spacing"},
      {"PhantomOptions::direction", "--direction"},
      {"PhantomOptions::origin_ras_mm", "--origin"},
      {"PhantomOptions::edge_width_mm", "--edge-width"},
      {"PhantomOptions::edge_width", "--edge-width"},
      {"PhantomOptions::noise", "--noise"},
      {"PhantomOptions::wave_periods", "--wave"},
      {"SliceOptions::center_ras_mm", "--at"},
      {"SliceOptions::window", "--window"},
      {"SliceOptions::width", "--width"},
      {"SheetOptions::columns", "--sheet"},
      {"SheetOptions::n_slices", "--sheet"},
      {"RenderOptions::width", "--width"}};
  return names;
}

bool is_of_name(char letter) {
  return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '_';
}

/// Where the field's name with its members and index ends: "FlowOptions::step.rule", "seeds_mm[0]".
std::size_t end_of_field(const std::string& text, std::size_t at) {
  while (at < text.size() && (is_of_name(text[at]) || (text[at] == '.' && at + 1 < text.size() &&
                                                       is_of_name(text[at + 1]))))
    ++at;
  return at;
}

std::size_t end_of_index(const std::string& text, std::size_t at) {
  if (at >= text.size() || text[at] != '[') return at;
  const std::size_t closed = text.find(']', at);
  return closed == std::string::npos ? at : closed + 1;
}

}  // namespace

std::string with_option_names(const std::string& message, const std::string& program) {
  std::string out = message;
  for (std::size_t at = out.find("::"); at != std::string::npos; at = out.find("::", at + 2)) {
    std::size_t begin = at;
    while (begin > 0 && is_of_name(out[begin - 1])) --begin;
    const std::size_t end = end_of_field(out, at + 2);
    auto known = option_names().find(out.substr(begin, end_of_index(out, end) - begin));
    if (known == option_names().end()) known = option_names().find(out.substr(begin, end - begin));
    if (known == option_names().end()) continue;
    const bool is_area = known->second == "--volume" && program == "curveseg";
    const std::string name = is_area ? "--area" : known->second;
    out.replace(begin, end_of_index(out, end) - begin, name);
    at = begin;
  }
  // Where points are given in a space of choice.
  const std::string other_space = "is it in another space?";
  if ((out.starts_with("--seed") || out.starts_with("--outside") || out.starts_with("--box")) &&
      out.ends_with(other_space))
    out.insert(out.size() - 1, " (--space)");
  return out;
}

}  // namespace surfseg
