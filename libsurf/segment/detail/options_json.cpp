#include "libsurf/segment/detail/options_json.h"

#include <fmt/format.h>

#include <set>

#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/base/names.h"
#include "libsurf/segment/detail/whole_number.h"

namespace surf::segment {
namespace {

using Json = nlohmann::ordered_json;

/// The names of an enum's values, for those fields that are one.
template <class Enum>
constexpr Names<Enum> kNames = {};
template <>
constexpr Names<volume::DerivativeFilter> kNames<volume::DerivativeFilter> = {
    {volume::DerivativeFilter::kBSpline, "bspline"}, {volume::DerivativeFilter::kScharr, "scharr"}};
template <>
constexpr Names<volume::Interpolation> kNames<volume::Interpolation> = {
    {volume::Interpolation::kSpline, "spline"}, {volume::Interpolation::kLinear, "linear"}};
template <>
constexpr Names<mesh::Topology> kNames<mesh::Topology> = {{mesh::Topology::kFree, "free"},
                                                          {mesh::Topology::kFixed, "fixed"},
                                                          {mesh::Topology::kGenus0, "genus0"}};
template <>
constexpr Names<mesh::Keep> kNames<mesh::Keep> = {
    {mesh::Keep::kAll, "all"}, {mesh::Keep::kLargest, "largest"}, {mesh::Keep::kSeeded, "seeded"}};
template <>
constexpr Names<flow::Method> kNames<flow::Method> = {
    {flow::Method::kGradientFlow, "gradient-flow"},
    {flow::Method::kNewton, "newton"},
    {flow::Method::kLbfgs, "lbfgs"}};
template <>
constexpr Names<flow::ScalarProduct> kNames<flow::ScalarProduct> = {
    {flow::ScalarProduct::kL2, "l2"},
    {flow::ScalarProduct::kH1, "h1"},
    {flow::ScalarProduct::kHMinus1, "h-1"}};
template <>
constexpr Names<flow::Scheme> kNames<flow::Scheme> = {
    {flow::Scheme::kExplicit, "explicit"}, {flow::Scheme::kSemiImplicit, "semi-implicit"}};
template <>
constexpr Names<flow::StepBound> kNames<flow::StepBound> = {{flow::StepBound::kShape, "shape"},
                                                            {flow::StepBound::kVertex, "vertex"}};
template <>
constexpr Names<flow::StepRule> kNames<flow::StepRule> = {
    {flow::StepRule::kBacktracking, "backtracking"},
    {flow::StepRule::kLineSearch, "line-search"},
    {flow::StepRule::kFixed, "fixed"}};

/// Calls visit(name, field) for each field but points and the initial shape.
template <class OptionsType, class Visit>
void for_each_field(OptionsType& o, const Visit& visit) {
  visit("seed_radius_mm", o.seed_radius_mm);
  visit("energies", o.energies);
  visit("sigma_mm", o.sigma_mm);
  visit("selective_sigma_mm", o.selective_sigma_mm);
  visit("selective_threshold", o.selective_threshold);
  visit("derivative_filter", o.derivative_filter);
  visit("interpolation", o.interpolation);
  visit("edge_length_mm", o.edge_length_mm);
  visit("coarseness", o.coarseness);
  visit("geometry_tolerance_mm", o.geometry_tolerance_mm);
  visit("integral_tolerance", o.integral_tolerance);
  visit("gamma_refine", o.gamma_refine);
  visit("gamma_coarsen", o.gamma_coarsen);
  visit("topology", o.topology);
  visit("topology_resolution_mm", o.topology_resolution_mm);
  visit("sheet_distance_mm", o.sheet_distance_mm);
  visit("open_cavities", o.open_cavities);
  visit("n_levels", o.n_levels);
  visit("n_coarse_steps", o.n_coarse_steps);
  visit("coarse_geometry", o.coarse_geometry);
  visit("continued_geometry", o.continued_geometry);
  visit("first_threshold", o.first_threshold);
  visit("second_threshold", o.second_threshold);
  visit("continuation_returns", o.continuation_returns);
  visit("settle", o.settle);
  visit("locate", o.locate);
  visit("components.fill_cavities", o.components.fill_cavities);
  visit("components.min_content", o.components.min_content);
  visit("components.keep", o.components.keep);
  auto& flow = o.flow;
  visit("flow.method", flow.method);
  visit("flow.velocity.product", flow.velocity.product);
  visit("flow.velocity.scheme", flow.velocity.scheme);
  visit("flow.velocity.beta_floor", flow.velocity.beta_floor);
  visit("flow.velocity.solver_tolerance", flow.velocity.solver_tolerance);
  visit("flow.velocity.keeps_content", flow.velocity.keeps_content);
  visit("flow.step.rule", flow.step.rule);
  visit("flow.step.bound", flow.step.bound);
  visit("flow.step.alpha", flow.step.alpha);
  visit("flow.step.beta", flow.step.beta);
  visit("flow.step.epsilon_tau", flow.step.epsilon_tau);
  visit("flow.step.exempt_share", flow.step.exempt_share);
  visit("flow.step.max_trials", flow.step.max_trials);
  visit("flow.step.tau", flow.step.tau);
  visit("flow.step.tau_min", flow.step.tau_min);
  visit("flow.step.tau_max", flow.step.tau_max);
  visit("flow.keep_content", flow.keep_content);
  visit("flow.content", flow.content);
  visit("flow.max_steps", flow.max_steps);
  visit("flow.rel_tol", flow.rel_tol);
  visit("flow.energy_tol", flow.energy_tol);
  visit("flow.energy_window", flow.energy_window);
  visit("flow.energy_share_on_the_way", flow.energy_share_on_the_way);
  visit("flow.displacement_tol_mm", flow.displacement_tol_mm);
}

template <class T>
Json value_to_json(const T& value) {
  if constexpr (std::is_enum_v<T>)
    return name_of(value, kNames<T>);
  else
    return value;
}
template <class T>
Json value_to_json(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}
Json value_to_json(const std::vector<EnergyTerm>& terms) {
  Json out = Json::array();
  for (const EnergyTerm& term : terms) out.push_back(to_string(term));
  return out;
}

template <class T>
void value_from_json(const Json& json, T& value) {
  if constexpr (std::is_enum_v<T>) {
    const auto name = json.get<std::string>();
    const auto found = value_of(name, kNames<T>);
    if (!found) throw InputError(fmt::format("'{}' is none of its values", name));
    value = *found;
  } else if constexpr (std::is_same_v<T, int>) {
    value = whole_number(json);
  } else {
    value = json.get<T>();
  }
}
template <class T>
void value_from_json(const Json& json, std::optional<T>& value) {
  value.reset();
  if (!json.is_null()) value_from_json(json, value.emplace());
}
void value_from_json(const Json& json, std::vector<EnergyTerm>& terms) {
  terms.clear();
  for (const Json& text : json) terms.push_back(parse_term(text.get<std::string>()));
}

}  // namespace

template <int Dim>
Json to_json(const Options<Dim>& options) {
  std::map<std::string, Json> defaults;
  const Options<Dim> standard;
  for_each_field(standard, [&](const std::string& name, const auto& field) {
    defaults[name] = value_to_json(field);
  });
  Json out = Json::object();
  for_each_field(options, [&](const std::string& name, const auto& field) {
    Json value = value_to_json(field);
    if (value != defaults[name]) out[name] = std::move(value);
  });
  if (!options.samples_mm.empty()) {
    Json samples = Json::array();
    for (const Vector<Dim>& point : options.samples_mm)
      samples.push_back(std::vector<double>(point.begin(), point.end()));
    out["samples_mm"] = std::move(samples);
  }
  if (options.box_mm) {
    Json box = Json::array();
    for (const Vector<Dim>& corner : *options.box_mm)
      box.push_back(std::vector<double>(corner.begin(), corner.end()));
    out["box_mm"] = std::move(box);
  }
  if (options.initial) out["initial"] = shape_to_json<Dim>(*options.initial);
  return out;
}

template <int Dim>
std::vector<Vector<Dim>> points_from_json(const Json& json, const std::string& name) {
  std::vector<Vector<Dim>> out;
  for (const auto& numbers : json[name].get<std::vector<std::vector<double>>>()) {
    if (numbers.size() != std::size_t(Dim))
      throw InputError(fmt::format("options: {}: a point has {} numbers; expected {}", name,
                                   numbers.size(), Dim));
    out.push_back(Eigen::Map<const Vector<Dim>>(numbers.data()));
  }
  return out;
}

template <int Dim>
Options<Dim> options_from_json(const Json& json) {
  Options<Dim> out;
  std::set<std::string> known = {"box_mm", "initial", "samples_mm"};
  for_each_field(out, [&](const std::string& name, auto& field) {
    known.insert(name);
    if (!json.contains(name)) return;
    try {
      value_from_json(json[name], field);
    } catch (const std::exception& error) {
      throw InputError(fmt::format("options: {}: {}", name, error.what()));
    }
  });
  for (const auto& [name, value] : json.items())
    if (!known.contains(name))
      throw InputError(fmt::format("options: '{}' is unknown", one_line(name)));
  if (json.contains("samples_mm")) out.samples_mm = points_from_json<Dim>(json, "samples_mm");
  if (json.contains("box_mm")) {
    const std::vector<Vector<Dim>> corners = points_from_json<Dim>(json, "box_mm");
    if (corners.size() != 2)
      throw InputError(
          fmt::format("options: box_mm: {} corners; expected two opposite ones", corners.size()));
    out.box_mm = {corners[0], corners[1]};
  }
  if (json.contains("initial")) out.initial = shape_from_json<Dim>(json["initial"]);
  return out;
}

template <int Dim>
Json shape_to_json(const Simplices<Dim>& shape) {
  Json points = Json::array(), elements = Json::array();
  for (Eigen::Index i = 0; i < shape.points.size(); ++i) points.push_back(shape.points.data()[i]);
  for (Eigen::Index i = 0; i < shape.elements.size(); ++i)
    elements.push_back(shape.elements.data()[i]);
  return {{"points", points}, {"elements", elements}};
}

template <int Dim>
Simplices<Dim> shape_from_json(const Json& json) {
  const auto points = json.at("points").get<std::vector<double>>();
  std::vector<int> elements;
  for (const Json& vertex : json.at("elements")) elements.push_back(whole_number(vertex));
  if (points.size() % Dim != 0 || elements.size() % Dim != 0)
    throw InputError(
        fmt::format("initial: {} numbers of points and {} of elements are no rows of {}",
                    points.size(), elements.size(), Dim));
  Simplices<Dim> out;
  out.points = Eigen::Map<const Points<Dim>>(points.data(), Eigen::Index(points.size() / Dim), Dim);
  out.elements =
      Eigen::Map<const Elements<Dim>>(elements.data(), Eigen::Index(elements.size() / Dim), Dim);
  for (const int vertex : elements)
    if (vertex < 0 || vertex >= out.points.rows())
      throw InputError(fmt::format("initial: an element names point {}; there are {}", vertex,
                                   out.points.rows()));
  return out;
}

template Json to_json<2>(const Options<2>&);
template Json to_json<3>(const Options<3>&);
template Options<2> options_from_json<2>(const Json&);
template Options<3> options_from_json<3>(const Json&);
template Json shape_to_json<2>(const Segments&);
template Json shape_to_json<3>(const Triangles&);
template Segments shape_from_json<2>(const Json&);
template Triangles shape_from_json<3>(const Json&);

}  // namespace surf::segment
