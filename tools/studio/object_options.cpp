#include "tools/studio/object_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/base/error.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/segment/energy_description.h"
#include "libsurf/segment/presets.h"
#include "libsurf/volume/write_volume.h"

namespace surfseg::studio {
namespace {

using nlohmann::ordered_json;
using Options = surf::segment::Options<3>;

ObjectOption length(std::string key, std::string label, std::string group, std::string help,
                    std::optional<double> Options::*field) {
  ObjectOption out;
  out.key = std::move(key);
  out.label = std::move(label);
  out.group = std::move(group);
  out.unit = "mm";
  out.type = "number";
  out.help = std::move(help);
  out.get = [field](const Options& options) {
    return options.*field ? ordered_json(*(options.*field)) : ordered_json();
  };
  out.set = [field](Options& options, const ordered_json& value) {
    if (value.is_null())
      (options.*field).reset();
    else
      options.*field = value.get<double>();
  };
  return out;
}

/// Of anything that `at(options)` refers to; null sets what it is by default.
template <class At>
ObjectOption plain(std::string key, std::string label, std::string group, std::string unit,
                   std::string type, std::string help, At at) {
  ObjectOption out;
  out.key = std::move(key);
  out.label = std::move(label);
  out.group = std::move(group);
  out.unit = std::move(unit);
  out.type = std::move(type);
  out.help = std::move(help);
  out.get = [at](const Options& options) {
    return ordered_json(at(const_cast<Options&>(options)));
  };
  out.set = [at](Options& options, const ordered_json& value) {
    Options standard;
    using Value = std::remove_reference_t<decltype(at(options))>;
    at(options) = value.is_null() ? at(standard) : value.get<Value>();
  };
  return out;
}

/// Of an enum whose values are 0, 1, ... in the order of the choices.
template <class At>
ObjectOption choice(std::string key, std::string label, std::string group, std::string help,
                    const std::vector<std::string>& choices, At at) {
  ObjectOption out;
  out.key = std::move(key);
  out.label = std::move(label);
  out.group = std::move(group);
  out.type = "choice";
  out.help = std::move(help);
  out.choices = choices;
  out.get = [at, choices](const Options& options) {
    return ordered_json(choices.at(std::size_t(at(const_cast<Options&>(options)))));
  };
  out.set = [at, choices](Options& options, const ordered_json& value) {
    using Value = std::remove_reference_t<decltype(at(options))>;
    const std::string word = value.is_null() ? choices.front() : value.get<std::string>();
    const auto found = std::find(choices.begin(), choices.end(), word);
    if (found == choices.end())
      throw surf::UsageError(fmt::format("'{}': expected one of {}", word,
                                         fmt::join(choices.begin(), choices.end(), ", ")));
    at(options) = Value(found - choices.begin());
  };
  return out;
}

ObjectOption energies() {
  ObjectOption out;
  out.key = "energies";
  out.label = "energy";
  out.group = "energy";
  out.type = "energies";
  out.help = "Terms NAME:key=value,... as on the command line; none: fitted to the image";
  out.get = [](const Options& options) {
    ordered_json terms = ordered_json::array();
    for (const auto& term : options.energies) terms.push_back(to_string(term));
    return terms;
  };
  out.set = [](Options& options, const ordered_json& value) {
    options.energies.clear();
    if (value.is_null()) return;
    for (const auto& text : value)
      options.energies.push_back(surf::segment::parse_term(text.get<std::string>()));
  };
  return out;
}

std::vector<ObjectOption> all_options() {
  std::vector<ObjectOption> out;
  out.push_back(length("edge_length_mm", "edge length", "surface",
                       "Edges of the surface where it is finest", &Options::edge_length_mm));
  out.push_back(plain("coarseness", "coarseness", "surface", "", "number",
                      "Edges may be this many times longer where the surface is flat; 1: all alike",
                      [](Options& o) -> double& { return o.coarseness; }));
  out.back().minimum = 1;
  out.push_back(length("sigma_mm", "smoothing", "surface",
                       "Gaussian smoothing of the scan before edges are looked for",
                       &Options::sigma_mm));
  out.push_back(plain("settle", "settle on edges", "surface", "", "boolean",
                      "Move the surface on to the edges at the end",
                      [](Options& o) -> bool& { return o.settle; }));
  out.push_back(choice("topology", "topology", "topology",
                       "free: sheets that meet are joined; fixed: held apart; genus0: no handles",
                       {"free", "fixed", "genus0"},
                       [](Options& o) -> surf::mesh::Topology& { return o.topology; }));
  out.push_back(length("topology_resolution_mm", "resolution", "topology",
                       "What is thinner is joined or cut", &Options::topology_resolution_mm));
  out.push_back(plain("open_cavities", "open cavities", "topology", "", "boolean",
                      "Open cavities where the energy asks for them",
                      [](Options& o) -> bool& { return o.open_cavities; }));
  out.push_back(plain("fill_cavities", "fill cavities", "components", "", "boolean",
                      "Fill cavities, with all that lies in them",
                      [](Options& o) -> bool& { return o.components.fill_cavities; }));
  out.push_back(plain("min_component_mm3", "least component", "components", "mm3", "number",
                      "Drop components of less volume",
                      [](Options& o) -> double& { return o.components.min_content; }));
  out.push_back(choice("keep", "keep", "components",
                       "All components, the largest, or those that contain a click",
                       {"all", "largest", "seeded"},
                       [](Options& o) -> surf::mesh::Keep& { return o.components.keep; }));
  out.push_back(energies());
  out.push_back(plain("max_steps", "steps at most", "energy", "", "integer", "Steps of each stage",
                      [](Options& o) -> int& { return o.flow.max_steps; }));
  return out;
}

/// As the page has them.
std::vector<std::string> without_dots(std::vector<std::string> endings) {
  for (std::string& ending : endings) ending.erase(0, 1);
  return endings;
}

}  // namespace

const std::vector<ObjectOption>& object_options() {
  static const std::vector<ObjectOption> options = all_options();
  return options;
}

ordered_json options_to_json(const Options& options) {
  const Options standard;
  ordered_json out = ordered_json::object();
  for (const ObjectOption& option : object_options())
    if (const ordered_json value = option.get(options); value != option.get(standard))
      out[option.key] = value;
  return out;
}

void change_options(Options& options, const ordered_json& changes) {
  if (!changes.is_object()) throw surf::UsageError("options: expected an object");
  for (const auto& [key, value] : changes.items()) {
    const auto& all = object_options();
    const auto option = std::find_if(
        all.begin(), all.end(), [&, &key = key](const ObjectOption& o) { return o.key == key; });
    if (option == all.end()) throw surf::UsageError(fmt::format("there is no option '{}'", key));
    try {
      option->set(options, value);
    } catch (const nlohmann::json::exception&) {
      throw surf::UsageError(
          fmt::format("{}: expected {}; got {}", key, option->type, value.dump()));
    }
  }
  if (const std::string error = options.error(); !error.empty()) throw surf::UsageError(error);
}

Options with_preset(const Options& options, Options preset) {
  preset.box_mm = options.box_mm;
  preset.initial = options.initial;
  preset.samples_mm = options.samples_mm;
  return preset;
}

ordered_json describe_options() {
  ordered_json options = ordered_json::array();
  const Options standard;
  for (const ObjectOption& option : object_options())
    options.push_back({{"key", option.key},
                       {"label", option.label},
                       {"group", option.group},
                       {"unit", option.unit},
                       {"type", option.type},
                       {"minimum", option.minimum},
                       {"help", option.help},
                       {"standard", option.get(standard)},
                       {"choices", option.choices}});
  ordered_json energies = ordered_json::array();
  for (const auto& kind : ordered_json::parse(surf::segment::energies_as_json<3>())) {
    ordered_json parameters = ordered_json::array();
    for (const auto& parameter : kind["parameters"])
      parameters.push_back({{"key", parameter["key"]},
                            {"unit", parameter["unit"]},
                            {"help", parameter["meaning"]},
                            {"range", parameter["range"]},
                            {"standard", parameter["default_text"]}});
    energies.push_back({{"name", kind["name"]},
                        {"formula", kind["formula"]},
                        {"help", kind["description"]},
                        {"parameters", parameters}});
  }
  ordered_json presets = ordered_json::array();
  for (const auto& preset : surf::segment::presets())
    presets.push_back({{"name", preset.name}, {"words", preset.description}});
  return {{"options", options},
          {"energies", energies},
          {"presets", presets},
          {"export",
           {{"surface", without_dots(surf::io::surface_endings())},
            {"labels", without_dots(surf::volume::label_map_endings())},
            {"measures", {"csv"}},
            {"picture", {"png"}},
            {"report", {"html"}},
            {"recipe", {"json"}}}}};
}

}  // namespace surfseg::studio
