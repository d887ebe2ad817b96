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

/// tau V, (n, Dim), with StepBound::kVertex no row longer than max_displacement.
template <int Dim>
Points<Dim> bounded_displacement(const Points<Dim>& velocity, double tau, double max_displacement,
                                 StepBound bound);

/// The time step for which no vertex moves further than the shape allows and Alg. 3 holds, with
/// StepBound::kVertex for bounded_displacement(); 0 if the velocity is 0 or not finite.
template <int Dim>
double largest_step(const fem::Geometry<Dim>& shape, const Points<Dim>& velocity,
                    double max_displacement, const StepOptions& options);

/// The stepper of options.method.
template <int Dim>
std::unique_ptr<Stepper<Dim>> make_stepper(const StepSetting<Dim>& setting);

/// Makes the steppers of one method.
struct StepperMaker {
  std::unique_ptr<Stepper<2>> (*in_plane)(const StepSetting<2>&);
  std::unique_ptr<Stepper<3>> (*in_space)(const StepSetting<3>&);

  template <int Dim>
  std::unique_ptr<Stepper<Dim>> make(const StepSetting<Dim>& setting) const {
    if constexpr (Dim == 2)
      return in_plane(setting);
    else
      return in_space(setting);
  }
};
template <template <int> class Method>
constexpr StepperMaker stepper_maker() {
  return {[](const StepSetting<2>& setting) -> std::unique_ptr<Stepper<2>> {
            return std::make_unique<Method<2>>(setting);
          },
          [](const StepSetting<3>& setting) -> std::unique_ptr<Stepper<3>> {
            return std::make_unique<Method<3>>(setting);
          }};
}
extern const StepperMaker kGradientSteppers, kNewtonSteppers, kLbfgsSteppers;

}  // namespace surf::flow
