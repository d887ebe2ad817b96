// The table of energy kinds: their names, formulas and parameters, and how each is built.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/mesh/neighbourhood.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/segment/energy_term.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {

template <int Dim>
class Setting;

/// What defaults and fields of an energy may depend on: the image, and where the run starts. It is
/// lent for the time of a call; an energy keeps fields made from it.
template <int Dim>
struct KindContext {
  /// Fields of the image, with the blur of the level that the energy is for.
  EnergyModel<Dim>& model;
  /// Where parameters are chosen: the seeds, or the centre of the start [world mm].
  std::vector<Vector<Dim>> seeds_mm = {};
  SeedModel seed = {};        ///< what the image says there; all 0 without a seed
  double seed_radius_mm = 0;  ///< of the balls or circles that the run starts from
  /// Deviation of the blur of the edges round the seeds, smoothing included; 0 = unknown.
  double edge_blur_mm = 0;
  /// The shape that the run begins with in place of such balls, the same one in all its stages and
  /// on all levels, so that what is fitted to it (EnergyKind::is_fitted) stays as it is; null if
  /// there is none.
  const Simplices<Dim>* initial = nullptr;
  /// The image that it lies in.
  const Setting<Dim>* setting = nullptr;
  /// Where the shape moves; null = everywhere.
  const mesh::Neighbourhood<Dim>* region = nullptr;

  double cell_mm() const { return model.extent().cell_mm(); }
};

/// The values that a parameter may have.
struct ParameterRange {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  bool excludes_lowest = false;
  std::vector<double> values = {};  ///< these alone, if there are any

  bool contains(double value) const;
  std::string text() const;       ///< "> 0", "1, 0, -1", "any number"
  std::string violation() const;  ///< "violates > 0", "is none of 1, 0, -1"

  static ParameterRange any() { return {}; }
  static ParameterRange positive() { return {.lowest = 0, .excludes_lowest = true}; }
  static ParameterRange not_negative() { return {.lowest = 0}; }
  static ParameterRange one_of(std::vector<double> values) { return {.values = std::move(values)}; }
};

/// What a parameter is where none is given.
template <int Dim>
struct ParameterDefault {
  /// @param term  with the parameters that come before this one in the kind
  using Choice = std::function<double(const KindContext<Dim>&, const EnergyTerm& term)>;

  std::optional<double> constant;
  Choice choice;  ///< from the image and the seeds; neither: the parameter stays absent
  std::string text;

  bool is_absent() const { return !constant && !choice; }

  static ParameterDefault of(double value);
  /// @param text  says what is chosen
  static ParameterDefault chosen(Choice choice, std::string text);
  /// @param text  says what holds without the parameter
  static ParameterDefault absent(std::string text);
};

template <int Dim>
struct KindParameter {
  std::string key = {};
  std::string unit = "-";
  std::string meaning = {};  ///< a few words
  ParameterRange range = {};
  ParameterDefault<Dim> standard = {};
  /// On a level whose blur is b times as wide the value is b^blur_power times that of the result:
  /// -1 for gradients at a step, 1 for widths of edges.
  double blur_power = 0;
};

/// One entry of the table. Only the name and `build` are needed. The functions may be called from
/// several threads at once, with a context each.
template <int Dim>
struct EnergyKind {
  using Context = KindContext<Dim>;
  using FieldPointer = std::shared_ptr<const Field<Dim>>;

  std::string name = {};         ///< of letters, digits, '-', '_' and '.'
  std::string formula = {};      ///< in one line of plain text, with the thesis' number
  std::string description = {};  ///< a sentence
  std::vector<KindParameter<Dim>> parameters = {};

  /// @param term  checked, and every parameter in it that has a default
  std::function<std::unique_ptr<energy::ShapeEnergy<Dim>>(const Context&, const EnergyTerm&)>
      build = {};
  /// The fields that are integrated over the shape, or whose integral over the domain it bounds,
  /// dimensionless and of order 1: what its resolution has to follow (Alg. 7). None for
  /// statistics, which change with every step.
  std::function<std::vector<FieldPointer>(const Context&, const EnergyTerm&)> integrands = {};
  /// lambda of the edge indicator [intensity/mm] in whose valleys the minimisers lie.
  std::function<double(const EnergyTerm&)> edge_strength = {};
  /// The field whose valleys a node does not jump over in a long step; it is sampled by several
  /// threads at once. Surfaces take long steps only with one.
  std::function<FieldPointer(const Context&, const EnergyTerm&)> edge_field = {};
  /// Whether a run ends on the edges that it finds: the minimisers of the others are what was
  /// asked for.
  bool settles_on_edges = false;
  /// Whether the energy depends on the shape that a run begins with.
  bool is_fitted = false;
  /// Whether nodes may go several widths of the blur in a step.
  bool takes_long_steps = true;
  /// Where the image is approximated smoothly on both sides, along with the shape: how.
  std::function<PiecewiseSmooth(const EnergyTerm&)> piecewise_smooth = {};
  /// The term in the first part of Alg. 17; none: the model has no such part.
  std::function<EnergyTerm(const EnergyTerm&)> coarse = {};

  const KindParameter<Dim>* find_parameter(const std::string& key) const;
};

/// Adds a kind of the program that links the library; from then on it is used by its name. The
/// table belongs to the process and kinds stay until its end. This and the functions below may be
/// called from any thread at any time.
/// @throws UsageError  there is one of this name, or the kind is not as EnergyKind says; "auto",
///                     "list" and a parameter "weight" are taken
template <int Dim>
void register_kind(EnergyKind<Dim> kind);

/// Valid until the process ends.
/// @throws UsageError  there is none; the message names the nearest, and all
template <int Dim>
const EnergyKind<Dim>& find_kind(const std::string& name);

/// All of them, the library's own first.
template <int Dim>
std::vector<const EnergyKind<Dim>*> all_kinds();

/// Their names in alphabetical order: "alignment, anisotropic, ... and window".
template <int Dim>
std::string known_energies();

}  // namespace surf::segment
