// The stages of a segmentation: what is done one after the other to one object.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "libsurf/base/resources.h"
#include "libsurf/energy/energy_sum.h"
#include "libsurf/flow/evolution.h"
#include "libsurf/mesh/neighbourhood.h"
#include "libsurf/segment/certainty.h"
#include "libsurf/segment/click.h"
#include "libsurf/segment/fields.h"
#include "libsurf/segment/outcome.h"
#include "libsurf/segment/proposal.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/segment/verdict.h"

namespace surf::segment {

/// What a stage does with the shape.
enum class StageKind {
  kProposes,   ///< starts: no energy has been minimised
  kMinimises,  ///< an energy
  kCorrects    ///< moves the minimiser on to what it stands for
};

/// "proposes", ...
std::string to_string(StageKind kind);

struct StageReport {
  std::string name;
  StageKind kind = StageKind::kMinimises;
  Outcome outcome = Outcome::kConverged;
  std::string message;               ///< how it ended: one sentence for a person
  std::vector<EnergyTerm> energies;  ///< that it minimised, every parameter filled in
  double sigma_mm = 0;               ///< of its fields
  double edge_length_mm = 0;
  flow::FlowSummary flow;  ///< of a stage that minimises
  Resources used;          ///< by the whole of it
};

/// Called on the thread that runs the stages, after every step, with the stage's name and the
/// shape of this moment; false stops the run with the shape as it is. A stage that proposes counts
/// in k only. A run that is stopped by a token, at whatever moment, has the shape of the last call.
template <int Dim>
using ProgressOf = std::function<bool(const std::string& stage, const flow::StepRecord& record,
                                      const std::function<Simplices<Dim>()>& shape)>;

template <int Dim>
struct Result;

/// Of an evolution [mm].
struct Lengths {
  double sigma_mm = 0, edge_length_mm = 0, geometry_tolerance_mm = 0, seed_radius_mm = 0;
  double whole_blur_mm = 0;  ///< of the edges round the seeds, smoothing included; 0 = unknown
  double edge_blur_mm = 0;   ///< of the edges along the start, without smoothing; 0 = unknown
};

/// What the caller was told last of a stage that minimises.
template <int Dim>
struct Told {
  Simplices<Dim> shape;
  double border_share = 0;
  std::size_t n_reports = 0, n_notes = 0;  ///< before the stage
  std::size_t n_steps = 0;                 ///< of the stage
};

/// The object that stages work on: what they were asked, and what they have made so far.
template <int Dim>
struct Work : Lengths {
  Fields<Dim>& fields;
  const Options<Dim>& options;
  std::vector<Vector<Dim>> seeds_mm;  ///< inside clicks; without one the options' samples
  std::vector<Click<Dim>> clicks;     ///< all of them: what the shape has to obey
  ProgressOf<Dim> progress;
  std::stop_token stop;

  std::size_t n_others = 0;             ///< of the clicks, the first: inside ones of other objects
  ClickSearchPointer<Dim> search = {};  ///< what earlier clicks have found
  /// What an evolution with these options had come to rest at before further clicks; null if there
  /// is none.
  std::shared_ptr<const Result<Dim>> settled = {};
  /// An evolution with these options that had not come to its end, and whose shape is `shape`: to
  /// go on with its energy. Null if there is none.
  std::shared_ptr<const Result<Dim>> unfinished = {};
  std::vector<Proposal<Dim>> proposals = {};  ///< best first
  std::size_t chosen = 0;                     ///< of the proposals
  Simplices<Dim> start = {};    ///< that the evolution begins with; the same in all stages after it
  bool start_is_given = false;  ///< not seed balls
  Simplices<Dim> shape = {};
  /// Where the shape may move: the rest of it is at its minimum. Null = everywhere.
  std::shared_ptr<const mesh::Neighbourhood<Dim>> region = {};
  std::vector<EnergyTerm> energies = {};  ///< of the result, every parameter filled in
  SeedModel seed = {};
  /// Of the stage that minimised one last, for a correction that follows; null: to be made again.
  std::shared_ptr<energy::EnergySum<Dim>> energy = {};
  double border_share = 0;                       ///< of the length or area on the image's border
  std::optional<double> kept_content = {};       ///< of the start, where all stages keep it
  std::optional<Verdict<Dim>> verdict = {};      ///< of the chosen proposal
  std::optional<Certainty<Dim>> certainty = {};  ///< of the vertices of `shape`; none = unknown
  std::vector<StageReport> reports = {};
  std::vector<std::string> notes = {};

  const Setting<Dim>& setting() const { return fields.setting(); }
  double cell_mm() const { return setting().extent().cell_mm(); }
  /// Whether the caller has asked to stop.
  bool is_stopped() const { return has_stopped || stop.stop_requested(); }
  /// Tells the caller, unless it has asked to stop: what was under way then may have been cut
  /// short. False if the run has to stop.
  bool tell(const std::string& stage, const flow::StepRecord& record,
            const std::function<Simplices<Dim>()>& shape_now);
  /// After a stop by the token the work is what the caller was told last, so that a run that is
  /// stopped in that call is the same.
  void go_back_to_told();
  /// The last stage ends as one that was stopped in its last call.
  void note_stop();

  bool has_stopped = false;            ///< progress() said so
  std::optional<Told<Dim>> told = {};  ///< only if the token can stop
};

template <int Dim>
class Stage {
 public:
  virtual ~Stage() = default;
  /// Goes on from work.shape and leaves its own there, with a report.
  /// @return  false: nothing comes after it
  virtual bool run(Work<Dim>& work) const = 0;
};

template <int Dim>
using StagePointer = std::unique_ptr<const Stage<Dim>>;

/// The stages that the work asks for before the first of them has run, in order. A new one is a
/// file in stages/ and a line here.
/// @throws UsageError  an energy is unknown
template <int Dim>
std::vector<StagePointer<Dim>> plan(const Work<Dim>& work);

}  // namespace surf::segment
