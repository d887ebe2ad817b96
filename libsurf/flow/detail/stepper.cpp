#include "libsurf/flow/detail/stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libsurf/base/error.h"
#include "libsurf/flow/content.h"

namespace surf::flow {
namespace {

constexpr int kContentRounds = 3;  // in each, vertices that are held back are left out
constexpr double kShorter = 0.7;   // a step whose gradient is too large, by its vertices' bounds

}  // namespace

template <int Dim>
double Stepper<Dim>::try_displacement(const fem::Geometry<Dim>& shape,
                                      const Points<Dim>& displacement,
                                      const Eigen::VectorXd& content_direction,
                                      StepRecord& record) {
  const Points<Dim> wanted = shape.points() + displacement;
  to_ = wanted;
  record.held_share = moving_.restrict_move(to_);
  if (content_) keep_content(shape, wanted, content_direction, record);
  try {
    return energy_.try_move(shape.moved_to(to_));
  } catch (const InvalidMesh&) {
    return std::numeric_limits<double>::infinity();
  }
}

template <int Dim>
void Stepper<Dim>::keep_content(const fem::Geometry<Dim>& shape, const Points<Dim>& wanted,
                                const Eigen::VectorXd& content_direction, StepRecord& record) {
  Points<Dim> direction = content_direction.asDiagonal() * shape.directions();
  const double longest = std::min(moving_.max_displacement(), shape.radius());
  Points<Dim> before = wanted;
  for (int round = 0; round < kContentRounds; ++round) {
    for (Eigen::Index i = 0; i < to_.rows(); ++i)
      if (to_.row(i) != before.row(i)) direction.row(i).setZero();
    correct_content<Dim>(to_, shape.elements(), direction, *content_, longest);
    before = to_;
    record.held_share = std::max(record.held_share, moving_.restrict_move(to_));
    if (to_ == before) return;
  }
}

template <int Dim>
void Stepper<Dim>::accept(const fem::Geometry<Dim>& shape, StepRecord& record) {
  energy_.accept();
  record.energy = energy_.value();
  record.max_displacement_mm = (to_ - shape.points()).rowwise().norm().maxCoeff();
}

template <int Dim>
double largest_step(const fem::Geometry<Dim>& shape, const Points<Dim>& velocity,
                    double max_displacement, const StepOptions& options) {
  const double speed = velocity.rowwise().norm().maxCoeff();
  if (!(speed > 0) || !std::isfinite(speed)) return 0;
  const double tau = std::min(max_displacement, shape.radius()) / speed;
  const double gradient = max_velocity_gradient<Dim>(shape, velocity, options.exempt_share);
  const double least = gradient > 0 ? std::min(tau, options.epsilon_tau / gradient) : tau;
  if (options.bound == StepBound::kShape) return least;
  for (double longer = 1; longer > least; longer *= kShorter)
    if (max_velocity_gradient<Dim>(
            shape, bounded_displacement<Dim>(velocity, longer, max_displacement, options.bound),
            options.exempt_share) <= options.epsilon_tau)
      return longer;
  return least;
}

template <int Dim>
Points<Dim> bounded_displacement(const Points<Dim>& velocity, double tau, double max_displacement,
                                 StepBound bound) {
  Points<Dim> out = tau * velocity;
  if (bound == StepBound::kShape) return out;
  for (auto row : out.rowwise())
    if (const double length = row.norm(); length > max_displacement)
      row *= max_displacement / length;
  return out;
}

template <int Dim>
std::unique_ptr<Stepper<Dim>> make_stepper(const StepSetting<Dim>& setting) {
  switch (setting.options.method) {
    case Method::kNewton:
      return kNewtonSteppers.make<Dim>(setting);
    case Method::kLbfgs:
      return kLbfgsSteppers.make<Dim>(setting);
    case Method::kGradientFlow:
      break;
  }
  return kGradientSteppers.make<Dim>(setting);
}

template class Stepper<2>;
template class Stepper<3>;
template double largest_step<2>(const fem::Geometry<2>&, const Points<2>&, double,
                                const StepOptions&);
template double largest_step<3>(const fem::Geometry<3>&, const Points<3>&, double,
                                const StepOptions&);
template Points<2> bounded_displacement<2>(const Points<2>&, double, double, StepBound);
template Points<3> bounded_displacement<3>(const Points<3>&, double, double, StepBound);
template std::unique_ptr<Stepper<2>> make_stepper<2>(const StepSetting<2>&);
template std::unique_ptr<Stepper<3>> make_stepper<3>(const StepSetting<3>&);

}  // namespace surf::flow
