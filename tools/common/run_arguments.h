// The options of a run that surfseg and curveseg share.
#pragma once

#include <string>
#include <vector>

#include "libsurf/mesh/hierarchy.h"
#include "libsurf/segment/options.h"
#include "tools/common/cli_app.h"
#include "tools/common/progress.h"

namespace surfseg {

/// Words of the help that differ.
struct RunWords {
  std::string shape;    ///< "surface", "curve"
  std::string cell;     ///< "vox", "px"
  std::string image;    ///< "volume", "image"
  std::string content;  ///< "volume", "area"
  std::string measure;  ///< "area", "length"
  std::string power;    ///< of the content: "3", "2"
  std::string point;    ///< "X,Y,Z", "X,Y"
  std::string balls;    ///< "balls", "circles"
  std::string hole;     ///< "cavities", "holes"
  bool has_genus;
};

inline const RunWords kVolumeWords = {"surface", "vox",   "volume", "volume",   "area",
                                      "3",       "X,Y,Z", "balls",  "cavities", true};
inline const RunWords kImageWords = {"curve", "px",  "image",   "area",  "length",
                                     "2",     "X,Y", "circles", "holes", false};

/// The options as they were typed; lengths and the like are parsed when the image is known.
struct RunArguments {
  std::vector<std::string> objects, seeds, outside, boxes, marks;
  std::string radius, sigma, selective_sigma, edge_length, geometry_tolerance, topology_resolution,
      sheet_distance;
  std::string topology = "free";
  double selective_threshold = 0;
  std::string derivatives = "bspline";
  std::vector<std::string> energies;
  std::string lambda = "auto";
  double gamma = 0, gamma0 = 1;
  std::string flow = "h1", scheme = "auto", step_rule = "line-search";
  std::string kept_content;  ///< --volume or --area
  int max_iterations = 500;
  double coarseness = 4, integral_tolerance = 0.016;
  int levels = 1;
  double tolerance = 1e-4;
  double alpha = 0.25, beta = 0.75, epsilon_tau = 0.8, tau_min = 0, tau_max = 0;
  double gamma_refine = 0.7, gamma_coarsen = 0.65;
  int coarse_steps = 150;
  double coarse_geometry = 3, continued_geometry = 2, first_threshold = 5, second_threshold = 20;
  bool one_way = false;
  bool no_settle = false, locate = false, no_locate = false, open_cavities = false;
  std::string min_component = "0";
  bool fill_cavities = false;
  std::string keep = "all";
  int threads = 0;
  std::string json, config, preset, recipe, checkpoint, memory;
  bool resume = false;
  bool candidates = false, profile = false;
  bool quiet = false, verbose = false;

  Verbosity verbosity() const {
    return quiet ? Verbosity::kQuiet : verbose ? Verbosity::kVerbose : Verbosity::kNormal;
  }
  surf::mesh::Keep kept() const;
  /// The --energy terms with the shorthands --gamma, --gamma0 and --lambda filled in.
  /// @param command  where the options were added
  /// @throws surf::UsageError
  std::vector<surf::segment::EnergyTerm> terms(const CLI::App& command) const;
};

/// Adds the options in their groups; those of a group come one after the other.
void add_start_options(CLI::App& command, RunArguments& a, const RunWords& words);
void add_run_options(CLI::App& command, RunArguments& a, const RunWords& words);
void add_marks_option(CLI::App& command, RunArguments& a, const RunWords& words);
void add_running_options(CLI::App& command, RunArguments& a);
void add_candidates_option(CLI::App& command, RunArguments& a);

/// What can be found wrong before the image is known.
/// @throws surf::UsageError
void check_run_arguments(const CLI::App& command, const RunArguments& a, const RunWords& words);

/// @throws surf::UsageError
void check_range(const char* option, int value, int lowest, const char* expected);

/// Everything but seeds, initial shape and what is filtered.
/// @param cell_mm  ImageExtent::cell_mm()
template <int Dim>
void set_run_options(const CLI::App& command, const RunArguments& a, double cell_mm,
                     surf::segment::Options<Dim>& out);

}  // namespace surfseg
