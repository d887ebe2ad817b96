#include <algorithm>
#include <map>

#include "libsurf/segment/detail/options_json.h"
#include "libsurf/segment/finish.h"

namespace surf::segment {
namespace {

using Json = nlohmann::ordered_json;

/// Names of lengths, areas and volumes in this dimension.
template <int Dim>
struct Keys {
  static constexpr const char* content = Dim == 3 ? "volume_mm3" : "area_mm2";
  static constexpr const char* measure = Dim == 3 ? "area_mm2" : "length_mm";
  static constexpr const char* elements = Dim == 3 ? "triangles" : "elements";
  static constexpr const char* manifold = Dim == 3 ? "manifold" : "simple";
  static constexpr const char* outward = Dim == 3 ? "outward" : "alternating";
  static constexpr const char* place = Dim == 3 ? "place_ras_mm" : "place_mm";
  static constexpr const char* center = Dim == 3 ? "center_ras_mm" : "center_mm";
  static constexpr const char* centroid = Dim == 3 ? "centroid_ras_mm" : "centroid_mm";
  static constexpr const char* content_deviation =
      Dim == 3 ? "volume_deviation_mm3" : "area_deviation_mm2";
  static constexpr const char* next_click = Dim == 3 ? "next_click_ras_mm" : "next_click_mm";
  static constexpr const char* change = Dim == 3 ? "volume_change_mm3" : "area_change_mm2";
  static constexpr const char* degenerate =
      Dim == 3 ? "degenerate_triangles" : "degenerate_elements";
  static constexpr const char* components = Dim == 3 ? "shells" : "regions";
  static constexpr const char* cavities = Dim == 3 ? "cavities" : "holes";
};

template <int Dim>
Json part_to_json(const Part<Dim>& part) {
  Json out = {{Keys<Dim>::content, part.content}, {Keys<Dim>::measure, part.measure}};
  if (Dim == 3) out["genus"] = part.genus;
  out[Keys<Dim>::center] = point_to_json<Dim>(part.center_mm);
  return out;
}

template <int Dim>
void add_measures(const Measures<Dim>& measures, Json& out) {
  using K = Keys<Dim>;
  out["vertices"] = measures.n_vertices;
  out[K::elements] = measures.n_elements;
  out[K::content] = measures.content;
  out[K::measure] = measures.measure;
  out[K::centroid] = point_to_json<Dim>(measures.centroid_mm);
  out["components"] = measures.n_components;
  out["closed"] = measures.closed;
  out[K::manifold] = measures.manifold;
  out[K::outward] = measures.outward;
  out["self_intersections"] = measures.n_self_intersections;
  out[K::degenerate] = measures.n_degenerate;
  if (Dim == 3) {
    out["min_angle_deg"] = measures.min_angle_deg;
    out["share_above_25_deg"] = measures.share_above_25_deg;
  }
  if (!measures.passed) return;
  out[K::components] = Json::array();
  for (const Component<Dim>& component : measures.components) {
    Json entry = part_to_json<Dim>(component);
    entry[K::cavities] = Json::array();
    for (const Part<Dim>& cavity : component.cavities)
      entry[K::cavities].push_back(part_to_json<Dim>(cavity));
    out[K::components].push_back(std::move(entry));
  }
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <int Dim>
Json certainty_to_json(const Certainty<Dim>& certainty) {
  std::vector<double> deviations, strengths;
  for (Eigen::Index i = 0; i < certainty.deviation_mm.size(); ++i) {
    if (certainty.deviation_mm[i] == 0)
      continue;  // on the image's border, where nothing is located
    deviations.push_back(certainty.deviation_mm[i]);
    strengths.push_back(certainty.edge_strength[i]);
  }
  Json out = {
      {Keys<Dim>::content_deviation, certainty.content_deviation},
      {"deviation_mm",
       {{"median", quantile(deviations, 0.5)}, {"percentile_95", quantile(deviations, 0.95)}}},
      {"edge_strength", {{"median", quantile(strengths, 0.5)}}},
      {"share_without_edge", certainty.share_without_edge}};
  if (certainty.next_click_mm)
    out[Keys<Dim>::next_click] = point_to_json<Dim>(*certainty.next_click_mm);
  return out;
}

Json texts_of(const std::vector<EnergyTerm>& terms) {
  Json out = Json::array();
  for (const EnergyTerm& term : terms) out.push_back(to_string(term));
  return out;
}

template <int Dim>
Json events_of(const Result<Dim>& result) {
  Json out = Json::array();
  for (const StageReport& stage : result.stages)
    for (const auto& step : stage.flow.steps)
      for (const auto& event : step.events) {
        Json at = Json::array();
        for (int axis = 0; axis < Dim; ++axis) at.push_back(event.place[axis]);
        out.push_back({{"stage", stage.name},
                       {"step", step.k},
                       {"kind", flow::to_string(event.kind)},
                       {Keys<Dim>::place, at},
                       {Keys<Dim>::change, event.enclosed_change}});
      }
  return out;
}

Json stage_to_json(const StageReport& stage) {
  Json out = {{"stage", stage.name},
              {"kind", to_string(stage.kind)},
              {"outcome", to_string(stage.outcome)},
              {"message", stage.message},
              {"time_s", stage.used.seconds},
              {"cpu_s", stage.used.cpu_seconds},
              {"peak_memory_mb", stage.used.peak_memory_mb}};
  if (stage.kind == StageKind::kProposes) return out;
  out["energies"] = texts_of(stage.energies);
  out["sigma_mm"] = stage.sigma_mm;
  out["edge_length_mm"] = stage.edge_length_mm;
  out["steps"] = stage.flow.steps.size();
  out["energy_before"] = stage.flow.initial_energy;
  out["energy_after"] = stage.flow.final_energy;
  return out;
}

/// @param measures, certainty  null if there is none
template <int Dim>
std::string summary_of(const Result<Dim>& result, const Measures<Dim>* measures,
                       const Certainty<Dim>* certainty) {
  Json out;
  out["outcome"] = to_string(result.outcome);
  out["stop_message"] = result.message;
  out["iterations"] = result.n_steps();
  if (const StageReport* main = result.main_stage(); main && main->kind == StageKind::kMinimises)
    out["energy"] = main->flow.final_energy;
  if (measures) add_measures<Dim>(*measures, out);
  if (certainty) out["certainty"] = certainty_to_json<Dim>(*certainty);
  out["border_share"] = result.border_share;
  for (const Removed<Dim>& part : result.removed)
    out["removed"].push_back({{"what", part.what},
                              {"shells", part.n_parts},
                              {Keys<Dim>::content, part.content},
                              {Keys<Dim>::center, point_to_json<Dim>(part.center_mm)}});
  if (result.verdict)
    out["verdict"] = {{"trust", to_string(result.verdict->trust)},
                      {"likelihood", result.verdict->likelihood},
                      {"right", result.verdict->n_right},
                      {"of", result.verdict->n_cases},
                      {"reason", result.verdict->reason},
                      {Keys<Dim>::place, point_to_json<Dim>(result.verdict->place_mm)}};
  out["topology_events"] = events_of(result);
  out["notes"] = result.notes;
  out["chosen"] = {{"sigma_mm", result.sigma_mm},
                   {"edge_length_mm", result.edge_length_mm},
                   {"geometry_tolerance_mm", result.geometry_tolerance_mm}};
  if (result.seed_radius_mm > 0) out["chosen"]["seed_radius_mm"] = result.seed_radius_mm;
  if (!result.energies.empty()) out["chosen"]["energies"] = texts_of(result.energies);
  for (const Proposal<Dim>& proposal : result.proposals)
    out["proposals"].push_back({{"score", proposal.score},
                                {Keys<Dim>::content, proposal.enclosed},
                                {"mean", proposal.mean},
                                {"half_width", proposal.half_width},
                                {"neck_radius_mm", proposal.neck_radius_mm}});
  for (const StageReport& stage : result.stages) out["evolution"].push_back(stage_to_json(stage));
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

template <int Dim>
std::string summary_json(const Result<Dim>& result, const Finished<Dim>* finished) {
  if (!finished) return summary_of<Dim>(result, nullptr, nullptr);
  return summary_of<Dim>(result, &finished->measures,
                         finished->certainty ? &*finished->certainty : nullptr);
}

template <int Dim>
std::string summary_json(const Result<Dim>& result, const Measures<Dim>& failed) {
  return summary_of<Dim>(result, &failed, nullptr);
}

template std::string summary_json<2>(const Result<2>&, const Finished<2>*);
template std::string summary_json<3>(const Result<3>&, const Finished<3>*);
template std::string summary_json<2>(const Result<2>&, const Measures<2>&);
template std::string summary_json<3>(const Result<3>&, const Measures<3>&);

}  // namespace surf::segment
