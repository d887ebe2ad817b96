#include "tools/slicer/cli/arguments.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <sstream>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/read_landmarks.h"
#include "tools/common/outputs.h"

namespace surfseg::slicer {
namespace {

using Words = std::vector<std::string>;

/// Of surfaces in LPS, as the description has it; others have frames of their own.
constexpr std::array kSurfaceEndings = {".vtp", ".stl", ".ply", ".obj"};

void add_parameter(CLI::App& app, const Parameter& parameter, Arguments& arguments) {
  if (is_given_back(parameter)) return;
  if (parameter.kind == Kind::kVolume) {
    app.add_option(parameter.name, arguments.volume, parameter.description)->required();
    return;
  }
  const std::string flag = flag_of(parameter);
  if (parameter.kind == Kind::kFlag) {
    app.add_flag(flag, arguments.flags[parameter.name], parameter.description);
    return;
  }
  CLI::Option* option =
      app.add_option(flag, arguments.values[parameter.name], parameter.description)
          ->allow_extra_args(false);
  if (parameter.kind == Kind::kPoints)
    option->take_all();
  else
    option->expected(1);
  if (parameter.kind == Kind::kChoice)
    option->check(CLI::IsMember(parameter.choices))->default_str(parameter.standard);
}

/// "12.5,-30,44" of one point, or several apart by semicolons.
Words points_of(const std::string& text) {
  Words out;
  std::stringstream stream(text);
  for (std::string point; std::getline(stream, point, ';');) out.push_back(point);
  return out;
}

/// In LPS, as the points that are passed; so is a text that does not say its space.
Words points_in(const std::string& path) {
  const surf::io::Landmarks landmarks = surf::io::read_landmarks(path);
  if (landmarks.points.cols() != 3)
    throw surf::InputError(fmt::format("{}: its points have no third coordinate", path));
  const double sign = landmarks.is_ras ? -1 : 1;
  Words out;
  for (Eigen::Index n = 0; n < landmarks.points.rows(); ++n)
    out.push_back(fmt::format("{},{},{}", sign * landmarks.points(n, 0),
                              sign * landmarks.points(n, 1), landmarks.points(n, 2)));
  return out;
}

Words terms_of(const std::string& text) {
  std::stringstream stream(text);
  Words out;
  for (std::string term; stream >> term;) out.push_back(term);
  return out;
}

/// What one value of a parameter stands for: each is a value of its option.
Words values_of(const Parameter& parameter, const std::string& text) {
  if (parameter.kind == Kind::kPoints) return points_of(text);
  if (parameter.kind == Kind::kPointFile) return points_in(text);
  if (parameter.option == "--energy") return terms_of(text);
  return text.empty() || text == parameter.standard ? Words{} : Words{text};
}

bool is_end_of_option(const std::string& text, std::size_t at) {
  return at >= text.size() ||
         (std::isalnum(static_cast<unsigned char>(text[at])) == 0 && text[at] != '-');
}

}  // namespace

std::string Arguments::value(const std::string& name) const {
  const auto found = values.find(name);
  return found == values.end() || found->second.empty() ? "" : found->second.front();
}

void add_parameters(CLI::App& app, const std::vector<Parameter>& parameters, Arguments& arguments) {
  for (const Parameter& parameter : parameters) add_parameter(app, parameter, arguments);
  app.add_option("--returnparameterfile", arguments.return_file,
                 "File to write the measures to, a line NAME = VALUE for each");
  app.add_option("--progress", arguments.progress, "Progress on stdout: tags or none")
      ->check(CLI::IsMember({"tags", "none"}))
      ->capture_default_str();
  app.add_option("surplus", arguments.surplus)->group("");
}

void check(const Arguments& arguments, const std::vector<Parameter>& parameters) {
  // A host that takes what is given back for an argument passes its standard.
  for (const std::string& word : arguments.surplus)
    if (std::none_of(parameters.begin(), parameters.end(), [&](const Parameter& parameter) {
          return is_given_back(parameter) && parameter.standard == word;
        }))
      throw surf::UsageError(fmt::format("'{}' is one argument too many", word));
  if (arguments.value("inside").empty() && arguments.value("inside_file").empty())
    throw surf::UsageError("--inside: at least one point inside the object is needed");
  const std::string surface = arguments.value("surface"), labels = arguments.value("labels");
  if (surface.empty() && labels.empty())
    throw surf::UsageError("--surface, --labels: nothing is to be written; give one of them");
  if (!surface.empty() && std::find(kSurfaceEndings.begin(), kSurfaceEndings.end(),
                                    surf::extension(surface)) == kSurfaceEndings.end())
    throw surf::UsageError(fmt::format(
        "--surface: {}: expected a name that ends in .vtp, .stl, .ply or .obj", surface));
  check_volume_name("--labels", labels);
  check_outputs({{"--surface", surface},
                 {"--labels", labels},
                 {"--returnparameterfile", arguments.return_file}},
                {{"the input", arguments.volume}});
}

Words segment_words(const CLI::App& app, const std::vector<Parameter>& parameters,
                    const Arguments& arguments) {
  Words out;
  std::map<std::string, std::size_t> n_seen;
  for (const CLI::Option* given : app.parse_order()) {
    const auto found =
        std::find_if(parameters.begin(), parameters.end(), [&](const Parameter& parameter) {
          return !parameter.option.empty() && given->check_lname(parameter.name);
        });
    if (found == parameters.end()) continue;
    if (found->kind == Kind::kFlag) {
      if (arguments.flags.at(found->name)) out.push_back(found->option);
      continue;
    }
    const Words& values = arguments.values.at(found->name);
    const std::size_t n = n_seen[found->name]++;
    if (n >= values.size()) continue;
    for (const std::string& value : values_of(*found, values[n]))
      out.insert(out.end(), {found->option, value});
  }
  return out;
}

std::string with_flags(const std::string& message, const std::vector<Parameter>& parameters) {
  std::string out = message;
  for (const Parameter& parameter : parameters) {
    if (parameter.option.empty() || parameter.kind == Kind::kPointFile) continue;
    const std::string flag = flag_of(parameter);
    for (std::size_t at = out.find(parameter.option); at != std::string::npos;
         at = out.find(parameter.option, at + 1))
      if (is_end_of_option(out, at + parameter.option.size()))
        out.replace(at, parameter.option.size(), flag);
  }
  const std::string other_space = " (--space)";
  if (const std::size_t at = out.find(other_space); at != std::string::npos)
    out.erase(at, other_space.size());
  return out;
}

}  // namespace surfseg::slicer
