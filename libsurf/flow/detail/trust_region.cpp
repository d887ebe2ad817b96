#include "libsurf/flow/detail/trust_region.h"

#include <cmath>

namespace surf::flow {
namespace {

/// P^-1 on the space where q^T V = 0: P-orthogonal projection after it.
class Preconditioner {
 public:
  explicit Preconditioner(const QuadraticModel& model) : model_(model) {
    if (!model.constraint) return;
    y_ = model.preconditioner(*model.constraint);
    qy_ = model.constraint->dot(y_);
  }

  Eigen::VectorXd operator()(const Eigen::VectorXd& residual) const {
    Eigen::VectorXd out = model_.preconditioner(residual);
    if (model_.constraint) out -= model_.constraint->dot(out) / qy_ * y_;
    return out;
  }

 private:
  const QuadraticModel& model_;
  Eigen::VectorXd y_;
  double qy_ = 1;
};

/// The s > 0 with |V + s d| = radius.
double to_boundary(double vv, double vd, double dd, double radius) {
  const double left = radius * radius - vv;
  return left / (vd + std::sqrt(vd * vd + dd * left));
}

}  // namespace

double QuadraticModel::operator()(const Eigen::VectorXd& V) const {
  return gradient.dot(V) + V.dot(hessian(V)) / 2;
}

TrustRegionStep minimise_in_trust_region(const QuadraticModel& model, double radius,
                                         const TrustRegionOptions& options) {
  const Preconditioner precondition(model);
  TrustRegionStep step;
  step.V = Eigen::VectorXd::Zero(model.gradient.size());
  Eigen::VectorXd residual = model.gradient;
  Eigen::VectorXd y = precondition(residual);
  Eigen::VectorXd direction = -y;
  double ry = residual.dot(y);
  const double target = options.tolerance * options.tolerance * ry;
  double vv = 0, vd = 0, dd = ry;  // products of V and the direction in P
  while (step.n_iterations < options.max_iterations && ry > target) {
    ++step.n_iterations;
    const Eigen::VectorXd image = model.hessian(direction);
    const double curvature = direction.dot(image);
    const double length = ry / curvature;
    step.has_negative_curvature = !(curvature > 0);
    if (step.has_negative_curvature ||
        vv + 2 * length * vd + length * length * dd >= radius * radius) {
      step.V += to_boundary(vv, vd, dd, radius) * direction;
      step.is_at_boundary = true;
      vv = radius * radius;
      break;
    }
    step.V += length * direction;
    residual += length * image;
    vv += 2 * length * vd + length * length * dd;
    y = precondition(residual);
    const double ry_new = residual.dot(y);
    const double share = ry_new / ry;
    vd = share * (vd + length * dd);
    dd = ry_new + share * share * dd;
    direction = -y + share * direction;
    ry = ry_new;
  }
  step.norm = std::sqrt(vv);
  return step;
}

}  // namespace surf::flow
