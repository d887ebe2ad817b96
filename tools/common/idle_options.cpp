#include "tools/common/idle_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <algorithm>

#include "libsurf/segment/energy_assembly.h"

namespace surfseg {
namespace {

/// --gamma, --gamma0 and --lambda as far as they are given.
std::vector<std::string> shorthands(const CLI::App& command, const RunArguments& a) {
  std::vector<std::string> out;
  for (const char* option : {"--gamma", "--gamma0"})
    if (command.count(option) > 0) out.push_back(option);
  if (a.lambda != "auto") out.push_back("--lambda");
  return out;
}

bool has_energy(const RunArguments& a) {
  return std::any_of(a.energies.begin(), a.energies.end(),
                     [](const std::string& energy) { return energy != "auto"; });
}

}  // namespace

std::vector<std::string> idle_options(const CLI::App& command, const RunArguments& a,
                                      bool has_initial) {
  std::vector<std::string> out;
  const auto note = [&](bool is_idle, const std::string& option, const std::string& why) {
    if (is_idle) out.push_back(fmt::format("{} has no effect {}", option, why));
  };
  const auto terms = a.terms(command);
  const bool is_automatic = terms.empty();
  const bool has_time_step = a.flow != "newton" && a.flow != "lbfgs";
  const bool may_settle = is_automatic || (surf::segment::settle_on_edges<3>(terms) &&
                                           a.kept_content.empty() && a.flow != "h-1");
  const bool is_fitted = is_automatic || surf::segment::are_fitted<3>(terms);
  if (const auto given = shorthands(command, a); !given.empty() && !has_energy(a))
    out.push_back(
        fmt::format("{} {} --energy minimal-surface: the object is not looked for as it is "
                    "without an energy",
                    fmt::join(given, ", "), given.size() == 1 ? "means" : "mean"));
  note(a.candidates && (!is_automatic || (a.seeds.empty() && a.marks.empty())), "--candidates",
       is_automatic ? "without a --seed" : "with --energy: nothing is proposed");
  note(!a.radius.empty() && is_automatic, "--radius", "without --energy");
  note(!a.boxes.empty() && !is_automatic, "--box",
       "with an energy, whose minimum is not looked for in it");
  note(a.selective_threshold != 0 && a.selective_sigma.empty(), "--selective-threshold",
       "without --selective-sigma");
  note(a.no_settle && !may_settle, "--no-settle",
       "here: this energy, or a content that is kept, has no such stage");
  note(a.no_locate && !(is_fitted && may_settle && !a.no_settle), "--no-locate",
       "here: without --locate only what is fitted to the image, and settles, is located");
  note(!a.sheet_distance.empty() && a.topology != "fixed", "--sheet-distance",
       fmt::format("with --topology {}, where sheets may meet; it belongs to fixed", a.topology));
  note(!a.topology_resolution.empty() && a.topology == "fixed", "--topology-resolution",
       "with --topology fixed, where nothing is joined or cut");
  note(!has_time_step && a.scheme != "auto", "--scheme",
       fmt::format("with --flow {}, which has no time step", a.flow));
  note(!has_time_step && a.step_rule != "line-search", "--step-rule",
       fmt::format("with --flow {}, which has no time step", a.flow));
  note(!a.radius.empty() && has_initial && !is_automatic, "--radius",
       "where the initial shape is given");
  return out;
}

}  // namespace surfseg
