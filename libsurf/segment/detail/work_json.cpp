#include "libsurf/segment/detail/work_json.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "libsurf/base/error.h"
#include "libsurf/segment/detail/options_json.h"

namespace surf::segment {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN and no Inf.
Json from_double(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

double to_double(const Json& json) {
  if (json.is_number()) return json.get<double>();
  const auto word = json.get<std::string>();
  if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
  return (word == "inf" ? 1 : -1) * std::numeric_limits<double>::infinity();
}

Json from_doubles(const Eigen::VectorXd& values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(from_double(value));
  return out;
}

Eigen::VectorXd to_doubles(const Json& json) {
  Eigen::VectorXd out(Eigen::Index(json.size()));
  for (std::size_t i = 0; i < json.size(); ++i) out[Eigen::Index(i)] = to_double(json[i]);
  return out;
}

/// Each number of a struct under its name, there and back.
template <class F>
void for_each_number(flow::StepRecord& r, const F& f) {
  f("energy", r.energy);
  f("tau", r.tau);
  f("shape_derivative", r.shape_derivative);
  f("max_displacement_mm", r.max_displacement_mm);
  f("enclosed", r.enclosed);
  f("multiplier", r.multiplier);
  f("held_share", r.held_share);
}

template <int Dim, class F>
void for_each_number(Work<Dim>& w, const F& f) {
  f("sigma_mm", w.sigma_mm);
  f("edge_length_mm", w.edge_length_mm);
  f("geometry_tolerance_mm", w.geometry_tolerance_mm);
  f("seed_radius_mm", w.seed_radius_mm);
  f("whole_blur_mm", w.whole_blur_mm);
  f("edge_blur_mm", w.edge_blur_mm);
  f("border_share", w.border_share);
  f("seed_mean", w.seed.mean);
  f("seed_deviation", w.seed.deviation);
  f("seed_noise", w.seed.noise);
  f("seed_model_radius_mm", w.seed.radius_mm);
}

template <class T>
void numbers_to_json(const T& value, Json& out) {
  T copy = value;
  for_each_number(copy, [&](const char* name, double& number) { out[name] = from_double(number); });
}

template <class T>
void numbers_from_json(const Json& json, T& value) {
  for_each_number(value,
                  [&](const char* name, double& number) { number = to_double(json.at(name)); });
}

Json from_terms(const std::vector<EnergyTerm>& terms) {
  Json out = Json::array();
  for (const EnergyTerm& term : terms) {
    Json parameters = Json::object();
    for (const auto& [key, value] : term.parameters) parameters[key] = from_double(value);
    out.push_back({{"name", term.name},
                   {"weight", from_double(term.weight)},
                   {"parameters", std::move(parameters)}});
  }
  return out;
}

std::vector<EnergyTerm> to_terms(const Json& json) {
  std::vector<EnergyTerm> out;
  for (const Json& entry : json) {
    out.push_back({entry.at("name").get<std::string>(), to_double(entry.at("weight")), {}});
    for (const auto& [key, value] : entry.at("parameters").items())
      out.back().parameters[key] = to_double(value);
  }
  return out;
}

Json from_step(const flow::StepRecord& step) {
  Json out = {{"k", step.k},
              {"n_trials", step.n_trials},
              {"n_vertices", step.n_vertices},
              {"n_elements", step.n_elements}};
  numbers_to_json(step, out);
  out["events"] = Json::array();
  for (const flow::TopologyEvent& event : step.events)
    out["events"].push_back({{"kind", int(event.kind)},
                             {"place", from_doubles(event.place)},
                             {"enclosed_change", from_double(event.enclosed_change)}});
  return out;
}

flow::StepRecord to_step(const Json& json) {
  flow::StepRecord out;
  out.k = json.at("k").get<int>();
  out.n_trials = json.at("n_trials").get<int>();
  out.n_vertices = json.at("n_vertices").get<Eigen::Index>();
  out.n_elements = json.at("n_elements").get<Eigen::Index>();
  numbers_from_json(json, out);
  for (const Json& event : json.at("events")) {
    const Eigen::VectorXd place = to_doubles(event.at("place"));
    if (place.size() != 3) throw InputError("a place has three coordinates");
    out.events.push_back({flow::TopologyChange(event.at("kind").get<int>()), place,
                          to_double(event.at("enclosed_change"))});
  }
  return out;
}

Json from_report(const StageReport& report) {
  Json out = {{"name", report.name},
              {"kind", int(report.kind)},
              {"outcome", int(report.outcome)},
              {"message", report.message},
              {"energies", from_terms(report.energies)},
              {"sigma_mm", from_double(report.sigma_mm)},
              {"edge_length_mm", from_double(report.edge_length_mm)},
              {"seconds", report.used.seconds},
              {"cpu_seconds", report.used.cpu_seconds},
              {"peak_memory_mb", report.used.peak_memory_mb},
              {"termination", int(report.flow.termination)},
              {"flow_message", report.flow.message},
              {"initial_energy", from_double(report.flow.initial_energy)},
              {"final_energy", from_double(report.flow.final_energy)}};
  out["steps"] = Json::array();
  for (const flow::StepRecord& step : report.flow.steps) out["steps"].push_back(from_step(step));
  return out;
}

StageReport to_report(const Json& json) {
  StageReport out;
  out.name = json.at("name").get<std::string>();
  out.kind = StageKind(json.at("kind").get<int>());
  out.outcome = Outcome(json.at("outcome").get<int>());
  out.message = json.at("message").get<std::string>();
  out.energies = to_terms(json.at("energies"));
  out.sigma_mm = to_double(json.at("sigma_mm"));
  out.edge_length_mm = to_double(json.at("edge_length_mm"));
  out.used = {json.at("seconds").get<double>(), json.at("cpu_seconds").get<double>(),
              json.at("peak_memory_mb").get<double>()};
  out.flow.termination = flow::Termination(json.at("termination").get<int>());
  out.flow.message = json.at("flow_message").get<std::string>();
  out.flow.initial_energy = to_double(json.at("initial_energy"));
  out.flow.final_energy = to_double(json.at("final_energy"));
  for (const Json& step : json.at("steps")) out.flow.steps.push_back(to_step(step));
  return out;
}

template <int Dim>
Json from_certainty(const Certainty<Dim>& certainty) {
  Json out = {{"deviation_mm", from_doubles(certainty.deviation_mm)},
              {"edge_strength", from_doubles(certainty.edge_strength)},
              {"has_edge", certainty.has_edge},
              {"content_deviation", from_double(certainty.content_deviation)},
              {"share_without_edge", from_double(certainty.share_without_edge)}};
  if (certainty.next_click_mm) out["next_click_mm"] = from_doubles(*certainty.next_click_mm);
  return out;
}

template <int Dim>
Certainty<Dim> to_certainty(const Json& json) {
  Certainty<Dim> out;
  out.deviation_mm = to_doubles(json.at("deviation_mm"));
  out.edge_strength = to_doubles(json.at("edge_strength"));
  out.has_edge = json.at("has_edge").get<std::vector<char>>();
  out.content_deviation = to_double(json.at("content_deviation"));
  out.share_without_edge = to_double(json.at("share_without_edge"));
  if (json.contains("next_click_mm")) {
    const Eigen::VectorXd point = to_doubles(json["next_click_mm"]);
    if (point.size() != Dim) throw InputError("a click of another dimension");
    out.next_click_mm = Vector<Dim>(point);
  }
  return out;
}

StagesDone done_in(const Json& json) {
  StagesDone out{json.at("n_stages").get<std::size_t>(), json.at("goes_on").get<bool>()};
  for (const Json& report : json.at("reports")) out.n_steps += int(report.at("steps").size());
  return out;
}

/// f(the document), with what is wrong with it told in one line.
template <class F>
StagesDone read(const std::string& state, const F& f) {
  try {
    return f(Json::parse(state));
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("checkpoint: {}", error.what()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("checkpoint: {}", error.what()));
  }
}

}  // namespace

template <int Dim>
std::string state_of(const Work<Dim>& work, std::size_t n_stages, bool goes_on) {
  Json out = {{"n_stages", n_stages}, {"goes_on", goes_on}};
  numbers_to_json(work, out);
  out["start_is_given"] = work.start_is_given;
  out["start"] = shape_to_json<Dim>(work.start);
  out["shape"] = shape_to_json<Dim>(work.shape);
  out["energies"] = from_terms(work.energies);
  if (work.kept_content) out["kept_content"] = from_double(*work.kept_content);
  if (work.certainty) out["certainty"] = from_certainty<Dim>(*work.certainty);
  out["notes"] = work.notes;
  out["reports"] = Json::array();
  for (const StageReport& report : work.reports) out["reports"].push_back(from_report(report));
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <int Dim>
StagesDone restore(const std::string& state, Work<Dim>& work) {
  return read(state, [&](const Json& json) {
    numbers_from_json(json, work);
    work.start_is_given = json.at("start_is_given").get<bool>();
    work.start = shape_from_json<Dim>(json.at("start"));
    work.shape = shape_from_json<Dim>(json.at("shape"));
    work.energies = to_terms(json.at("energies"));
    work.kept_content.reset();
    if (json.contains("kept_content")) work.kept_content = to_double(json["kept_content"]);
    work.certainty.reset();
    if (json.contains("certainty")) work.certainty = to_certainty<Dim>(json["certainty"]);
    work.notes = json.at("notes").get<std::vector<std::string>>();
    work.reports.clear();
    for (const Json& report : json.at("reports")) work.reports.push_back(to_report(report));
    return done_in(json);
  });
}

StagesDone stages_done(const std::string& state) { return read(state, done_in); }

template std::string state_of<2>(const Work<2>&, std::size_t, bool);
template std::string state_of<3>(const Work<3>&, std::size_t, bool);
template StagesDone restore<2>(const std::string&, Work<2>&);
template StagesDone restore<3>(const std::string&, Work<3>&);

}  // namespace surf::segment
