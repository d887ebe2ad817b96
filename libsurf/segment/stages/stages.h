// The stages that there are, one in each file of this folder, and what they share.
#pragma once

#include "libsurf/segment/clicks.h"
#include "libsurf/segment/detail/edges_along.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/segment/stage.h"

namespace surf::segment {

/// Regions round the clicks, best first; the shape is the boundary of the chosen one.
template <int Dim>
StagePointer<Dim> propose_stage();
/// Takes what the evolution before had come to rest at, but for where further clicks have changed
/// the region; what fit_stage() does if that does not pay.
template <int Dim>
StagePointer<Dim> amend_stage();
/// Chooses smoothing, lengths and the energy of a result from the edges along the proposal.
template <int Dim>
StagePointer<Dim> fit_stage();
/// Takes energy, smoothing and lengths of an evolution that had not come to its end.
template <int Dim>
StagePointer<Dim> go_on_stage();
/// Seed balls or the initial shape, and the parameters of explicit energies that are not given.
template <int Dim>
StagePointer<Dim> start_stage();
/// The energy with 2^level times the blur and the lengths of the result.
template <int Dim>
StagePointer<Dim> level_stage(int level);
/// As its report names it.
std::string level_name(int level);
/// The first part of Alg. 17, and its loop, which ends at the minimum of the energy.
inline constexpr const char* kCoarseName = "coarse";
template <int Dim>
StagePointer<Dim> coarse_stage();
template <int Dim>
StagePointer<Dim> continued_stage();
/// The energy, to its minimum.
template <int Dim>
StagePointer<Dim> evolve_stage();
/// Holes where the energy asks for them, and on from there.
template <int Dim>
StagePointer<Dim> cavities_stage();
/// On to the edges that have been found, by int H dS alone.
template <int Dim>
StagePointer<Dim> settle_stage();
/// Takes off the bias of the curvature.
template <int Dim>
StagePointer<Dim> offset_stage();

/// On to the edges that are fitted to the image as it is, with how sure they are.
template <int Dim>
StagePointer<Dim> locate_stage();

/// A stage that moves the shape on from where the stage before it has left it: run() leaves a
/// report with that stage's energies and lengths, and the time.
template <int Dim>
class CorrectingStage : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const final;

 private:
  virtual const char* name() const = 0;
  /// Moves work.shape.
  /// @return  what was done, in one sentence for a person; empty: it was stopped, nothing was done
  virtual std::string correct(Work<Dim>& work) const = 0;
};

/// work.shape with its vertices at `to`, but for those beyond work.region, past no click that it
/// obeys, and free of intersections.
template <int Dim>
Simplices<Dim> moved_past_clicks(const Work<Dim>& work, Points<Dim> to);

/// The fields of this smoothing, as the options ask for them.
template <int Dim>
FieldOptions field_options(const Options<Dim>& options, double sigma_mm);

/// What energies may depend on, with the fields of a model.
template <int Dim>
KindContext<Dim> context(const Work<Dim>& work, EnergyModel<Dim>& model);

/// Standard deviation of the fields' blur [mm]: the Gaussian's and the spline's.
double blur_mm(double sigma_mm, double cell_mm);

/// How near a shape may come to a click [mm]: half a cell, and a little for rounding.
double held_distance_mm(double cell_mm);

/// Of the shape of a stage with these fields.
template <int Dim>
mesh::MovingShapeOptions<Dim> shape_options(const Work<Dim>& work, double edge_length_mm,
                                            double sigma_mm);

/// What the edges along work.start look like, as far from it as a proposal may be off.
template <int Dim>
EdgesAlong edges_along_start(Work<Dim>& work);

/// Leaves the report of a stage that chooses what the evolution begins with.
/// @return  false: it was stopped
template <int Dim>
bool begins(Work<Dim>& work, const char* name, std::string message);

/// One minimisation from work.shape.
template <int Dim>
struct Minimisation {
  std::string name;
  std::vector<EnergyTerm> terms;  ///< complete
  double sigma_mm = 0;
  flow::FlowOptions flow;
  mesh::MovingShapeOptions<Dim> shape;
  /// The shape may take long steps and stop at the edges on its way.
  bool may_take_long_steps = true;
  /// Asked after every step: why it is over, in a sentence, else empty. None = the flow knows.
  std::function<std::string(const flow::StepRecord&)> ends = {};
};

/// Runs it, and leaves shape and report in `work`.
/// @return  false: stopped, vanished or ended by an obstacle
template <int Dim>
bool minimise(Work<Dim>& work, const Minimisation<Dim>& minimisation);

}  // namespace surf::segment
