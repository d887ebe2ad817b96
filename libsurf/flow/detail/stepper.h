// One step of an evolution, by one of the methods; private to flow/*.cpp.
#pragma once

#include <memory>
#include <optional>

#include "libsurf/flow/evolution.h"

namespace surf::flow {

/// What a step works on; all must outlive the stepper.
template <int Dim>
struct StepSetting {
  MovingShape<Dim>& moving;
  energy::ShapeEnergy<Dim>& energy;
  const FlowOptions& options;
  std::optional<double> content;  ///< to keep
};

/// Finds the next shape.
template <int Dim>
class Stepper {
 public:
  explicit Stepper(const StepSetting<Dim>& setting)
      : moving_(setting.moving),
        energy_(setting.energy),
        options_(setting.options),
        content_(setting.content) {}
  virtual ~Stepper() = default;

  /// Fills the record and takes the new shape as the energy's current one; false if no step
  /// decreases J.
  /// @param shape  the current shape
  virtual bool advance(const fem::Geometry<Dim>& shape, StepRecord& record) = 0;
  /// Where the last step leads.
  const Points<Dim>& destination() const { return to_; }

 protected:
  /// J where the displacement leads as far as the moving shape lets it, corrected along
  /// content_direction to the content that is kept; infinite if an element has no measure there.
  double try_displacement(const fem::Geometry<Dim>& shape, const Points<Dim>& displacement,
                          const Eigen::VectorXd& content_direction, StepRecord& record);
  /// Takes the last try as the current shape.
  void accept(const fem::Geometry<Dim>& shape, StepRecord& record);

  MovingShape<Dim>& moving_;
  energy::ShapeEnergy<Dim>& energy_;
  const FlowOptions& options_;
  std::optional<double> content_;
  Points<Dim> to_;

 private:
  void keep_content(const fem::Geometry<Dim>& shape, const Points<Dim>& wanted,
                    const Eigen::VectorXd& content_direction, StepRecord& record);
};

/// The time step for which no vertex moves further than the shape allows and Alg. 3 holds; 0 if the
/// velocity is 0 or not finite.
template <int Dim>
double largest_step(const fem::Geometry<Dim>& shape, const Points<Dim>& velocity,
                    double max_displacement, const StepOptions& options);

/// The stepper of options.method.
template <int Dim>
std::unique_ptr<Stepper<Dim>> make_stepper(const StepSetting<Dim>& setting);
template <int Dim>
std::unique_ptr<Stepper<Dim>> make_gradient_stepper(const StepSetting<Dim>& setting);
template <int Dim>
std::unique_ptr<Stepper<Dim>> make_newton_stepper(const StepSetting<Dim>& setting);
template <int Dim>
std::unique_ptr<Stepper<Dim>> make_lbfgs_stepper(const StepSetting<Dim>& setting);

}  // namespace surf::flow
