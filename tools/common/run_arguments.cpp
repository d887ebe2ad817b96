#include "tools/common/run_arguments.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/segment/energy_description.h"
#include "libsurf/segment/segmentation.h"
#include "tools/common/arguments.h"
#include "tools/common/option_group.h"
#include "tools/common/preset_arguments.h"
#include "tools/common/program.h"

namespace surfseg {
namespace {

using surf::UsageError;
constexpr std::size_t kMostClicks = surf::segment::Segmentation<3>::kMostClicks;

/// "--volume" or "--area"
std::string content_option(const RunWords& words) { return "--" + words.content; }

/// The energy that --gamma, --gamma0 and --lambda are short for.
constexpr const char* kShortened = "minimal-surface";

bool is_flat(const RunWords& words) { return words.power == "2"; }

/// What "5000", "5000mm3" or "5ml" stands for [mm^Dim]; NaN if it is none.
double amount(const std::string& text, bool is_area) {
  using Units = std::vector<std::pair<std::string, double>>;
  const Units units =
      is_area ? Units{{"mm2", 1}, {"cm2", 100}} : Units{{"mm3", 1}, {"ml", 1000}, {"cm3", 1000}};
  std::string number = text;
  double unit = 1;
  for (const auto& [name, in_mm] : units)
    if (text.ends_with(name)) {
      number = text.substr(0, text.size() - name.size());
      unit = in_mm;
    }
  try {
    return parse_number("", number) * unit;
  } catch (const UsageError&) {
    return std::numeric_limits<double>::quiet_NaN();
  }
}

/// The content that a text stands for [mm^Dim]; nothing for "keep".
std::optional<double> parse_content(const std::string& option, const std::string& text,
                                    bool is_area) {
  if (text == "keep") return std::nullopt;
  const double value = amount(text, is_area);
  if (!(value > 0))
    throw UsageError(fmt::format("{}: expected keep, or a content such as {}; got '{}'", option,
                                 is_area ? "500mm2 or 5cm2" : "5000mm3 or 5ml", text));
  return value;
}

/// What cannot go together with the flow.
void check_flow(const CLI::App& command, const RunArguments& a, const RunWords& words) {
  const std::string option = content_option(words);
  const bool is_area = words.content == "area";
  if (!a.kept_content.empty()) parse_content(option, a.kept_content, is_area);
  const bool is_gradient_flow = a.flow != "newton" && a.flow != "lbfgs";
  const std::vector<const char*> of_gradient_flows = {"--alpha", "--beta", "--tau-min",
                                                      "--tau-max"};
  for (const char* given : of_gradient_flows)
    if (!is_gradient_flow && command.count(given) > 0)
      throw UsageError(fmt::format(
          "{}: it belongs to the flows h1, l2 and h-1; --flow {} has no time step", given, a.flow));
  if (!is_gradient_flow && a.scheme == "semi-implicit")
    throw UsageError(
        fmt::format("--scheme semi-implicit: it belongs to the flows h1, l2 and h-1; --flow {} has "
                    "no time step",
                    a.flow));
  if (a.flow == "lbfgs" && !a.kept_content.empty())
    throw UsageError(fmt::format("{}: --flow lbfgs cannot keep the {}; use h1, l2, h-1 or newton",
                                 option, words.content));
  if (!a.terms(command).empty()) return;
  if (!is_gradient_flow)
    throw UsageError(
        fmt::format("--flow {}: it needs an --energy; seeds alone grow by h1 or l2", a.flow));
  if (a.flow == "h-1" || !a.kept_content.empty())
    throw UsageError(
        fmt::format("{}: the {} stays, so that no seed can grow: give an --energy and "
                    "where to start",
                    a.flow == "h-1" ? "--flow h-1" : option, words.content));
}

template <int Dim>
void set_flow(const CLI::App& command, const RunArguments& a, surf::segment::Options<Dim>& out) {
  using namespace surf::flow;
  out.flow.max_steps = a.max_iterations;
  out.flow.rel_tol = a.tolerance;
  out.flow.step.alpha = a.alpha;
  out.flow.step.beta = a.beta;
  out.flow.step.epsilon_tau = a.epsilon_tau;
  out.flow.step.tau_min = a.tau_min;
  if (command.count("--tau-max") > 0) out.flow.step.tau_max = a.tau_max;
  out.flow.method = a.flow == "newton"  ? Method::kNewton
                    : a.flow == "lbfgs" ? Method::kLbfgs
                                        : Method::kGradientFlow;
  out.flow.velocity.product = a.flow == "l2"    ? ScalarProduct::kL2
                              : a.flow == "h-1" ? ScalarProduct::kHMinus1
                                                : ScalarProduct::kH1;
  const bool wants_implicit = a.flow == "l2" || a.flow == "h-1";
  const bool is_implicit = a.scheme == "semi-implicit" || (a.scheme == "auto" && wants_implicit);
  out.flow.velocity.scheme = is_implicit ? Scheme::kSemiImplicit : Scheme::kExplicit;
  if (a.step_rule == "backtracking") out.flow.step.rule = StepRule::kBacktracking;
  if (a.kept_content.empty()) return;
  out.flow.keep_content = true;
  out.flow.content = parse_content("--volume", a.kept_content, Dim == 2);
}

void add_image_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Image");
  group.add("--sigma", a.sigma,
            fmt::format("Gaussian smoothing, such as 1mm or 0.5{0} [0.7{0}]", words.cell));
  group.add("--selective-sigma", a.selective_sigma,
            "Selective Gaussian blur before it: smooths where differences are small");
  group.add("--selective-threshold", a.selective_threshold,
            fmt::format("Its threshold, in the {}'s intensities", words.image));
  group.add_choice("--derivatives", a.derivatives, "Gradient filter: bspline or scharr",
                   {"bspline", "scharr"});
}

void add_energy_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Energy");
  group
      .add_repeatable(
          "--energy", a.energies,
          fmt::format("Term NAME[:key=value,...] of the energy, repeatable, with NAME one of "
                      "{}, or list to print what they are; auto chooses from the seeds",
                      is_flat(words) ? surf::segment::known_energies<2>()
                                     : surf::segment::known_energies<3>()))
      ->each([is_flat = is_flat(words)](const std::string& text) {
        if (text == "list")
          throw Listing{is_flat ? surf::segment::describe_energies<2>()
                                : surf::segment::describe_energies<3>()};
      })
      ->default_str("auto");
  group.add_with_default("--lambda", a.lambda,
                         "Edge strength [intensity/mm] of minimal-surface, or auto");
  group.add("--gamma", a.gamma,
            fmt::format("Weight of its {} term [1/mm]; < 0 grows [auto]", words.content));
  group.add("--gamma0", a.gamma0, fmt::format("Weight of its {} term [1]", words.measure));
  group.add_flag("--locate", a.locate,
                 fmt::format("At last move the {} on to the edges that fit the {} and say how sure "
                             "they are [where the image chooses the energy]",
                             words.shape, words.image));
  group.add_flag("--no-locate", a.no_locate,
                 fmt::format("Leave the {} at the energy's minimum", words.shape));
  group.add_flag("--no-settle", a.no_settle, "Skip the last stage, which settles on the edges");
}

void add_flow_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Flow");
  group.add_with_default(
      "--levels", a.levels,
      fmt::format("Begin with coarser {}s in an image that is smoothed more: each level "
                  "doubles sigma and edges",
                  words.shape));
  group.add_choice(
      "--flow", a.flow,
      fmt::format("Gradient flow of a scalar product: h1 (weighted, inexact Newton), l2, "
                  "h-1 (keeps the {}); or newton (trust region), lbfgs",
                  words.content),
      {"h1", "l2", "h-1", "newton", "lbfgs"});
  group.add_choice(
      "--scheme", a.scheme,
      "Time discretisation of gradient flows; auto: explicit for h1, else semi-implicit",
      {"auto", "explicit", "semi-implicit"});
  group.add(content_option(words), a.kept_content,
            fmt::format("Keep the {} by a multiplier: keep, that of the start, or {}",
                        words.content, words.content == "area" ? "500mm2, 5cm2" : "5000mm3, 5ml"));
  group.add_choice("--step-rule", a.step_rule, "Time step: line-search or backtracking",
                   {"line-search", "backtracking"});
  group.add_with_default("--max-iterations", a.max_iterations,
                         "Steps per stage; exit code 5 if they do not suffice");
  group.add_with_default("--tolerance", a.tolerance,
                         "Stop when the shape derivative falls to this share of its largest value");
  group.add_with_default("--alpha", a.alpha,
                         "Least decrease that the line search accepts, by the expected one");
  group.add_with_default("--beta", a.beta,
                         "Largest decrease that the line search accepts, by the expected one: a "
                         "longer step is tried where it is larger");
  group.add_with_default("--epsilon-tau", a.epsilon_tau,
                         "Bound of the time step times the velocity's gradient");
  group.add_with_default("--tau-min", a.tau_min, "No shorter time step is tried");
  group.add("--tau-max", a.tau_max, "No longer time step is taken [no bound]");
  if (!is_flat(words)) a.coarse_steps = 0;
  group.add_with_default("--coarse-steps", a.coarse_steps,
                         "Most steps of the coarse stage of mumford-shah; 0: neither it nor fixed "
                         "steps after it");
  group.add_with_default("--coarse-geometry", a.coarse_geometry,
                         "Of the coarse stage: the geometry tolerance, by that of the result");
  group.add_with_default("--continued-geometry", a.continued_geometry,
                         "The same after it, while the shape derivative is above the second "
                         "threshold");
  group.add_with_default(
      "--first-threshold", a.first_threshold,
      "Steps are fixed while the shape derivative is above this, by --tolerance");
  group.add_with_default("--second-threshold", a.second_threshold,
                         "The coarse stage ends where it has fallen to this");
  group.add_flag(
      "--one-way", a.one_way,
      "After the coarse stage: no way back to fixed steps and the larger tolerance where "
      "the shape derivative grows again");
}

void add_mesh_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Mesh");
  const std::string is_flat = words.has_genus ? "flat" : "straight";
  group.add("--edge-length", a.edge_length,
            fmt::format("Edges of the result where it is finest, such as 2mm [1.5{}]", words.cell));
  group.add_with_default(
      "--coarseness", a.coarseness,
      fmt::format("Edges may be this many times longer where the {} is {}; 1: all the "
                  "same",
                  words.shape, is_flat));
  group.add("--geometry-tolerance", a.geometry_tolerance,
            fmt::format("Bound on edge length times angle to the neighbours, summed over an "
                        "element's sides; the finest edges may exceed it [1{}]",
                        words.cell));
  group.add_with_default(
      "--integral-tolerance", a.integral_tolerance,
      fmt::format("Quadrature error of H, or of the window, per {} above which elements "
                  "are refined; 0: do not look",
                  words.measure));
  group.add_with_default("--gamma-refine", a.gamma_refine,
                         "Elements with more than this share of the largest indicator are refined "
                         "together with it");
  group.add_with_default("--gamma-coarsen", a.gamma_coarsen,
                         "Elements with less than this share of the tolerance may be coarsened; 0: "
                         "none is");
}

void add_topology_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Topology");
  std::vector<std::string> kinds = {"free", "fixed"};
  if (words.has_genus) kinds.push_back("genus0");
  group.add_choice("--topology", a.topology,
                   std::string("free: sheets that meet are joined, necks are cut; fixed: they are "
                               "held apart") +
                       (words.has_genus ? "; genus0: free, but without handles" : ""),
                   kinds);
  group.add("--topology-resolution", a.topology_resolution,
            "What is thinner is joined or cut where sheets meet, such as 1mm [0.7 of "
            "--edge-length]");
  group.add_flag("--open-cavities", a.open_cavities,
                 fmt::format("Open {} where chan-vese or window asks for them, though the {} came "
                             "from outside",
                             words.hole, words.shape));
  group.add("--sheet-distance", a.sheet_distance,
            "Distance at which sheets are held apart where they may not join, such as 1mm "
            "[0.7 of --edge-length]");
}

void add_component_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Components of the result, in this order");
  group.add_flag("--fill-cavities", a.fill_cavities,
                 fmt::format("Fill {}, with all that lies in them", words.hole));
  group.add_with_default("--min-component", a.min_component,
                         fmt::format("Drop components of less {}, such as {}, with their {}",
                                     words.content, is_flat(words) ? "50mm2" : "5ml", words.hole));
  group.add_choice("--keep", a.keep,
                   "Keep all components, the largest, or the seeded: those that contain a seed",
                   {"all", "largest", "seeded"});
}

}  // namespace

surf::mesh::Keep RunArguments::kept() const {
  return keep == "largest"  ? surf::mesh::Keep::kLargest
         : keep == "seeded" ? surf::mesh::Keep::kSeeded
                            : surf::mesh::Keep::kAll;
}

std::vector<surf::segment::EnergyTerm> RunArguments::terms(const CLI::App& command) const {
  std::vector<surf::segment::EnergyTerm> out;
  for (const std::string& text : energies)
    if (text != "auto") out.push_back(surf::segment::parse_term(text));
  const bool has_gamma = command.count("--gamma") > 0, has_gamma0 = command.count("--gamma0") > 0;
  const bool has_lambda = lambda != "auto";
  if (out.size() < energies.size() && (!out.empty() || has_gamma || has_gamma0 || has_lambda))
    throw UsageError(
        "--energy: auto finds and fits the whole energy; it is given alone, or not at all");
  if (!has_gamma && !has_gamma0 && !has_lambda) return out;
  if (out.empty()) out.push_back({kShortened, 1, {}});
  bool is_used = false;
  for (auto& term : out) {
    if (term.name != kShortened) continue;
    is_used = true;
    if (has_gamma) term.parameters.try_emplace("gamma", gamma);
    if (has_gamma0) term.parameters.try_emplace("gamma0", gamma0);
    if (has_lambda) term.parameters.try_emplace("lambda", parse_number("--lambda", lambda));
  }
  if (!is_used)
    throw UsageError(fmt::format(
        "--gamma, --gamma0, --lambda: they belong to --energy {}, which is not used", kShortened));
  return out;
}

void add_start_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  const OptionGroup group(command, "Where to start");
  group.add_repeatable("--seed", a.seeds,
                       fmt::format("Point {} inside the object; repeat for more", words.point));
  group.add_repeatable(
      "--outside", a.outside,
      fmt::format("Point {} that is not of the object; repeat for more: the {} stays "
                  "half a {} away from it",
                  words.point, words.shape, words.cell == "px" ? "pixel" : "voxel"));
  group.add_repeatable(
      "--box", a.boxes,
      fmt::format("Box {0},{0} that the object lies in: two opposite corners, the box "
                  "being along the {1}'s axes{2}, a centimetre or two larger than the "
                  "object; with --seed, one for each object",
                  words.point, words.image,
                  words.cell == "px" ? ""
                                     : " (of an oblique volume the least one that holds a box "
                                       "given in ras or lps)"));
  group.add("--radius", a.radius,
            fmt::format("Radius of the seed {} of an evolution, such as 10mm or 5{} [auto]",
                        words.balls, words.cell));
}

void add_run_options(CLI::App& command, RunArguments& a, const RunWords& words) {
  add_image_options(command, a, words);
  add_energy_options(command, a, words);
  add_flow_options(command, a, words);
  add_mesh_options(command, a, words);
  add_topology_options(command, a, words);
  add_component_options(command, a, words);
}

void add_running_options(CLI::App& command, RunArguments& a) {
  const OptionGroup group(command, "Output and running");
  group.add("--json", a.json, "Summary; it can be fed back as --config");
  group.add("--config", a.config, "JSON file of options; the command line wins");
  add_preset_option(command, a.preset, group.name());
  group.add("--recipe", a.recipe,
            "What was done, as a file that repeats it (segment::replay), with a hash of the "
            "image");
  group.add("--checkpoint", a.checkpoint,
            "FILE or FILE,SECONDS: the state of the run after each of its stages, no oftener than "
            "that; removed at the end");
  group.add_flag(
      "--resume", a.resume,
      "Go on from the --checkpoint of the same command that was killed, if there is one: "
      "the result is the same to the byte");
  group.add(
      "--memory", a.memory,
      "Memory that may be used, such as 2GB: fields are dropped and made again within it; what "
      "needs more ends in one line (code 3); the result is the same");
  group.add("--threads", a.threads, "Threads [all]; the result is the same");
  group.add_flag("--profile", a.profile,
                 "At the end where time and memory went: stage by stage, wall and CPU seconds, "
                 "steps, largest memory");
  group.add_flag("-q,--quiet", a.quiet, "Print errors only");
  group.add_flag("-v,--verbose", a.verbose, "Print every step");
}

void add_marks_option(CLI::App& command, RunArguments& a, const RunWords& words) {
  OptionGroup(command, "Where to start")
      .add_repeatable(
          "--marks", a.marks,
          fmt::format(
              "Label map of strokes on the {}'s own grid, 1 inside and 2 outside, as Slicer "
              "and ITK-SNAP paint them. Each connected stroke is one click, heeded after "
              "--seed and --outside: inside strokes before outside ones, each by size",
              words.image));
}

void add_candidates_option(CLI::App& command, RunArguments& a) {
  OptionGroup(command, "Output and running")
      .add_flag("--candidates", a.candidates,
                "Print what else the clicks may mean, the next best proposals of each of them, and "
                "write them beside the output: NAME.candidate-1, ...");
}

void check_range(const char* option, int value, int lowest, const char* expected) {
  if (value < lowest)
    throw UsageError(fmt::format("{}: expected {}; got {}", option, expected, value));
}

void check_run_arguments(const CLI::App& command, const RunArguments& a, const RunWords& words) {
  if (const std::size_t n = a.seeds.size() + a.outside.size(),
      most = kMostClicks * std::max<std::size_t>(1, a.objects.size());
      n > most)
    throw UsageError(fmt::format(
        "--seed, --outside: {} clicks; at most {} for an object; paint strokes and give them by "
        "--marks, each is one click",
        n, kMostClicks));
  check_range("--threads", a.threads, 0, "0 (all) or more");
  check_range("--max-iterations", a.max_iterations, 0, "0 or more");
  if (!(a.tolerance >= 0 && a.tolerance < 1))
    throw UsageError(fmt::format(
        "--tolerance: expected a number from 0 to below 1, such as 1e-4; got {}", a.tolerance));
  if (a.levels < 1 || a.levels > 6)
    throw UsageError(fmt::format("--levels: expected a number from 1 to 6; got {}", a.levels));
  if (!(a.coarseness >= 1 && a.coarseness <= 1000))
    throw UsageError(
        fmt::format("--coarseness: expected a number from 1 to 1000; got {}", a.coarseness));
  if (!(a.integral_tolerance >= 0))
    throw UsageError(
        fmt::format("--integral-tolerance: expected 0 or more; got {}", a.integral_tolerance));
  if (const double least = amount(a.min_component, is_flat(words));
      !(least >= 0 && std::isfinite(least)))
    throw UsageError(fmt::format("--min-component: expected {} {} of 0 or more, such as {}; got {}",
                                 words.content == "area" ? "an" : "a", words.content,
                                 is_flat(words) ? "50 (mm2) or 5cm2" : "50 (mm3) or 5ml",
                                 a.min_component));
  if (!(a.selective_threshold >= 0))
    throw UsageError(
        fmt::format("--selective-threshold: expected 0 or more; got {}", a.selective_threshold));
  for (const auto& [option, text] :
       {std::pair{"--sigma", a.sigma}, {"--selective-sigma", a.selective_sigma}})
    if (!text.empty()) parse_length(option, text);
  for (const auto& [option, text] : {std::pair{"--radius", a.radius},
                                     {"--edge-length", a.edge_length},
                                     {"--geometry-tolerance", a.geometry_tolerance},
                                     {"--topology-resolution", a.topology_resolution},
                                     {"--sheet-distance", a.sheet_distance}})
    if (!text.empty()) parse_positive_length(option, text);
  if (is_flat(words))
    surf::segment::check_terms<2>(a.terms(command));
  else
    surf::segment::check_terms<3>(a.terms(command));
  check_flow(command, a, words);
}

template <int Dim>
void set_run_options(const CLI::App& command, const RunArguments& a, double cell_mm,
                     surf::segment::Options<Dim>& out) {
  for (const CLI::Option* given : command.parse_order()) {
    if (given->check_lname("seed")) out.click_order.push_back(surf::segment::Side::kInside);
    if (given->check_lname("outside")) out.click_order.push_back(surf::segment::Side::kOutside);
  }
  const auto length = [&](const char* option, const std::string& text) -> std::optional<double> {
    if (text.empty()) return std::nullopt;
    return parse_length(option, text).mm(cell_mm);
  };
  out.seed_radius_mm = length("--radius", a.radius);
  out.sigma_mm = length("--sigma", a.sigma);
  out.selective_sigma_mm = length("--selective-sigma", a.selective_sigma).value_or(0);
  out.selective_threshold = a.selective_threshold;
  out.edge_length_mm = length("--edge-length", a.edge_length);
  out.coarseness = a.coarseness;
  out.n_levels = a.levels;
  out.geometry_tolerance_mm = length("--geometry-tolerance", a.geometry_tolerance);
  out.integral_tolerance = a.integral_tolerance;
  out.gamma_refine = a.gamma_refine;
  out.gamma_coarsen = a.gamma_coarsen;
  out.n_coarse_steps = a.coarse_steps;
  out.coarse_geometry = a.coarse_geometry;
  out.continued_geometry = a.continued_geometry;
  out.first_threshold = a.first_threshold;
  out.second_threshold = a.second_threshold;
  out.continuation_returns = !a.one_way;
  out.topology = a.topology == "fixed"    ? surf::mesh::Topology::kFixed
                 : a.topology == "genus0" ? surf::mesh::Topology::kGenus0
                                          : surf::mesh::Topology::kFree;
  out.sheet_distance_mm = length("--sheet-distance", a.sheet_distance);
  out.topology_resolution_mm = length("--topology-resolution", a.topology_resolution);
  if (a.derivatives == "scharr") out.derivative_filter = surf::volume::DerivativeFilter::kScharr;
  out.energies = a.terms(command);
  out.settle = !a.no_settle;
  if (a.locate && a.no_locate)
    throw surf::UsageError("--locate, --no-locate: they contradict each other; give one of them");
  if (a.locate || a.no_locate) out.locate = a.locate;
  out.open_cavities = a.open_cavities;
  out.components = {a.fill_cavities, amount(a.min_component, Dim == 2), a.kept()};
  set_flow<Dim>(command, a, out);
}

template void set_run_options<2>(const CLI::App&, const RunArguments&, double,
                                 surf::segment::Options<2>&);
template void set_run_options<3>(const CLI::App&, const RunArguments&, double,
                                 surf::segment::Options<3>&);

}  // namespace surfseg
