// Every shape energy by name, for tests and studies that hold for all of them.
#pragma once

#include <algorithm>

#include "libsurf/energy/anisotropic_integral.h"
#include "libsurf/energy/boundary_functional.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/content.h"
#include "libsurf/energy/curvature_integral.h"
#include "libsurf/energy/domain_functional.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/energy_sum.h"
#include "libsurf/energy/fields.h"
#include "libsurf/energy/region_statistics.h"
#include "libsurf/fem/stiffness.h"
#include "tests/surf/fixtures.h"

namespace surf::test {

/// H(x, y) = f(x) + f(x)^2 (b . y)^2 + c . y, not homogeneous in y.
template <int Dim>
class UserDensity : public energy::AnisotropicDensity<Dim> {
 public:
  explicit UserDensity(std::shared_ptr<const Field<Dim>> f)
      : f_(std::move(f)), square_(energy::mapped_field<Dim>(f_, [](double v) {
          return std::array<double, 3>{v * v, 2 * v, 2};
        })) {
    b_.setLinSpaced(0.4, -0.9);
    c_.setLinSpaced(0.3, 0.1);
  }
  void sample(const Points<Dim>& x, const Points<Dim>& y, Derivatives order,
              energy::DensitySamples<Dim>& out) const override {
    Samples<Dim> f, g;
    f_->sample(x, order, f);
    square_->sample(x, order, g);
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const double s = b_.dot(y.row(i));
      out.value[i] = f.value[i] + g.value[i] * s * s + c_.dot(y.row(i));
      if (order == Derivatives::kNone) continue;
      out.dx.row(i) = f.gradient.row(i) + s * s * g.gradient.row(i);
      out.dy.row(i) = (2 * g.value[i] * s * b_ + c_).transpose();
      if (order == Derivatives::kFirst) continue;
      out.dxx.row(i) = f.hessian.row(i) + s * s * g.hessian.row(i);
      using Matrix = Eigen::Matrix<double, Dim, Dim, Eigen::RowMajor>;
      Eigen::Map<Matrix>(out.dxy.row(i).data()) =
          2 * s * g.gradient.row(i).transpose() * b_.transpose();
      Eigen::Map<Matrix>(out.dyy.row(i).data()) = 2 * g.value[i] * b_ * b_.transpose();
    }
  }

 private:
  std::shared_ptr<const Field<Dim>> f_, square_;
  Vector<Dim> b_, c_;
};

/// H(x, z) = f(x) sqrt(1 + z^2).
template <int Dim>
class UserCurvatureDensity : public energy::CurvatureDensity<Dim> {
 public:
  explicit UserCurvatureDensity(std::shared_ptr<const Field<Dim>> f) : f_(std::move(f)) {}
  void sample(const Points<Dim>& x, const Eigen::VectorXd& z, Derivatives order,
              energy::CurvatureSamples<Dim>& out) const override {
    Samples<Dim> f;
    f_->sample(x, order, f);
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const double root = std::sqrt(1 + z[i] * z[i]);
      out.value[i] = f.value[i] * root;
      if (order == Derivatives::kNone) continue;
      out.dz[i] = f.value[i] * z[i] / root;
      out.dx.row(i) = root * f.gradient.row(i);
      if (order == Derivatives::kFirst) continue;
      out.dzz[i] = f.value[i] / (root * root * root);
      out.dxz.row(i) = z[i] / root * f.gradient.row(i);
      out.dxx.row(i) = root * f.hessian.row(i);
    }
  }

 private:
  std::shared_ptr<const Field<Dim>> f_;
};

/// (f - r)^2 with the mean r = p_1 / p_2, p = (int f, int 1), and its derivatives by p, as
/// functions of f: the variance of f, with two integrals in a density that is no product.
struct Variance {
  static energy::Profile at(const Eigen::VectorXd& p) {
    return [r = p[0] / p[1]](double f) {
      return std::array<double, 3>{(f - r) * (f - r), 2 * (f - r), 2};
    };
  }
  static double slope(const Eigen::VectorXd& p, int k) {
    return k == 0 ? 1 / p[1] : -p[0] / (p[1] * p[1]);
  }
  static energy::Profile first(const Eigen::VectorXd& p, int k) {
    return [r = p[0] / p[1], r_k = slope(p, k)](double f) {
      return std::array<double, 3>{-2 * (f - r) * r_k, -2 * r_k, 0};
    };
  }
  static energy::Profile second(const Eigen::VectorXd& p, int k, int l) {
    const double r_kl = k + l == 0   ? 0
                        : k + l == 1 ? -1 / (p[1] * p[1])
                                     : 2 * p[0] / (p[1] * p[1] * p[1]);
    return [r = p[0] / p[1], r_kl, product = slope(p, k) * slope(p, l)](double f) {
      return std::array<double, 3>{2 * product - 2 * (f - r) * r_kl, -2 * r_kl, 0};
    };
  }
};

/// int_Omega (f - mean of f)^2 dx.
template <int Dim>
class InnerVariance : public energy::FieldFamily<Dim> {
 public:
  using Pointer = typename energy::FieldFamily<Dim>::Pointer;
  explicit InnerVariance(Pointer f) : f_(f), integrands_{f, energy::constant_field<Dim>(1)} {}
  const std::vector<Pointer>& integrands() const override { return integrands_; }
  Pointer at(const Eigen::VectorXd& p) const override {
    return energy::mapped_field<Dim>(f_, Variance::at(p));
  }
  Pointer first(const Eigen::VectorXd& p, int k) const override {
    return energy::mapped_field<Dim>(f_, Variance::first(p, k));
  }
  Pointer second(const Eigen::VectorXd& p, int k, int l) const override {
    return energy::mapped_field<Dim>(f_, Variance::second(p, k, l));
  }

 private:
  Pointer f_;
  std::vector<Pointer> integrands_;
};

/// int_Gamma (f - mean of f)^2 dS.
template <int Dim>
class BoundaryVariance : public energy::DensityFamily<Dim> {
 public:
  using Pointer = energy::DensityPointer<Dim>;
  explicit BoundaryVariance(std::shared_ptr<const Field<Dim>> f) : inner_(std::move(f)) {
    for (const auto& w : inner_.integrands())
      integrands_.push_back(energy::isotropic_density<Dim>(w));
  }
  const std::vector<Pointer>& integrands() const override { return integrands_; }
  Pointer at(const Eigen::VectorXd& p) const override {
    return energy::isotropic_density<Dim>(inner_.at(p));
  }
  Pointer first(const Eigen::VectorXd& p, int k) const override {
    return energy::isotropic_density<Dim>(inner_.first(p, k));
  }
  Pointer second(const Eigen::VectorXd& p, int k, int l) const override {
    return energy::isotropic_density<Dim>(inner_.second(p, k, l));
  }

 private:
  InnerVariance<Dim> inner_;
  std::vector<Pointer> integrands_;
};

template <int Dim>
struct EnergyCase {
  std::string name;
  std::unique_ptr<energy::ShapeEnergy<Dim>> energy;
};

/// Where the energies of a test get their fields from.
template <int Dim>
struct EnergyFields {
  std::shared_ptr<const Field<Dim>> H;  ///< positive weight
  std::shared_ptr<const Field<Dim>> I;  ///< intensity
  energy::ImageTotals totals;           ///< of I over a domain that holds the shapes
  double ray_spacing_mm = 0.02;
  int quadrature_order = 2;
  double third_step_mm = 1e-3;  ///< of alignment_density
};

template <int Dim>
std::vector<EnergyCase<Dim>> every_energy(const EnergyFields<Dim>& fields) {
  using namespace energy;
  const auto& [H, I, totals, spacing, order, third_step] = fields;
  const DomainIntegralOptions domain{.quadrature_order = order, .ray_spacing_mm = spacing};
  const StatisticsOptions statistics{.quadrature_order = order, .ray_spacing_mm = spacing};
  const auto one = constant_field<Dim>(1);
  const Vector<Dim> metric = Vector<Dim>::LinSpaced(0.5, 2);
  const auto norm = norm_density<Dim>(H, metric.asDiagonal());
  const auto aligned = alignment_density<Dim>(I, signed_alignment(1, 2), third_step);
  const auto absolute = alignment_density<Dim>(I, absolute_alignment(2, 0.5), third_step);

  std::vector<EnergyCase<Dim>> cases;
  const auto add = [&](const std::string& name, std::unique_ptr<ShapeEnergy<Dim>> energy) {
    cases.push_back({name, std::move(energy)});
  };
  const auto boundary = [&, order = order](DensityPointer<Dim> density) {
    return std::make_unique<AnisotropicIntegral<Dim>>(std::move(density), order);
  };
  const auto functional = [&, order = order](std::shared_ptr<const DensityFamily<Dim>> family) {
    return std::make_unique<BoundaryFunctional<Dim>>(std::move(family), order);
  };
  const auto curved = [&](std::shared_ptr<const CurvatureDensity<Dim>> density) {
    return std::make_unique<CurvatureIntegral<Dim>>(std::move(density));
  };
  add("area", std::make_unique<BoundaryIntegral<Dim>>(one, order));
  add("content", std::make_unique<Content<Dim>>());
  add("boundary-integral", std::make_unique<BoundaryIntegral<Dim>>(H, order));
  add("domain-integral", std::make_unique<DomainIntegral<Dim>>(H, domain));
  add("window", std::make_unique<DomainIntegral<Dim>>(
                    mapped_field<Dim>(I, intensity_window(1.4, 0.4)), domain));
  add("anisotropic norm", boundary(norm));
  add("alignment", boundary(aligned));
  add("absolute alignment", boundary(absolute));
  add("user H(x, nu)", boundary(std::make_shared<const UserDensity<Dim>>(H)));
  add("willmore", curved(squared_curvature<Dim>(one, 0)));
  add("spontaneous curvature", curved(squared_curvature<Dim>(one, 0.7)));
  add("prescribed curvature", curved(squared_curvature<Dim>(H, 0.7)));
  add("user H(x, kappa)", curved(std::make_shared<const UserCurvatureDensity<Dim>>(H)));
  add("average edge", functional(average<Dim>(isotropic_density<Dim>(H))));
  add("average alignment", functional(average<Dim>(absolute)));
  add("variance along the boundary", functional(std::make_shared<const BoundaryVariance<Dim>>(H)));
  add("chan-vese", std::make_unique<ChanVese<Dim>>(I, totals,
                                                   ChanVeseOptions{.quadrature_order = order,
                                                                   .ray_spacing_mm = spacing,
                                                                   .intensity_scale = 0.7}));
  add("region competition", std::make_unique<RegionStatistics<Dim>>(
                                "region-competition", I, region_competition(totals), statistics));
  add("inner variance", std::make_unique<DomainFunctional<Dim>>(
                            std::make_shared<const InnerVariance<Dim>>(I), domain));
  auto sum = std::make_unique<EnergySum<Dim>>();
  add_minimal_surface<Dim>(*sum, H, 0.7, -1.3, domain);
  sum->add(0.5, std::make_unique<ChanVese<Dim>>(I, totals, ChanVeseOptions{}));
  sum->add(0.2, functional(average<Dim>(norm)));
  sum->add(0.1, curved(squared_curvature<Dim>(H, 0.2)));
  add("sum", std::move(sum));
  return cases;
}

/// Analytic fields.
template <int Dim>
EnergyFields<Dim> wave_fields(unsigned seed) {
  const auto H = std::make_shared<const WaveField<Dim>>(seed);
  return {.H = H, .I = H, .totals = {30, 44, 70}};
}

/// A smooth random star-shaped shape about the origin with its exact normals: the radius is a
/// product of plane waves on the sphere.
template <int Dim>
struct SmoothShape {
  Points<Dim> X;
  Elements<Dim> T;
  Points<Dim> normals;
};

template <int Dim>
SmoothShape<Dim> smooth_shape(unsigned seed, int level) {
  const auto sphere = unit_sphere<Dim>(level);
  SmoothShape<Dim> out{sphere.X, sphere.T, sphere.X};
  Points<Dim> log_gradient = Points<Dim>::Zero(sphere.X.rows(), Dim);  // of the radius
  for_random_waves<Dim>(seed, [&](const Vector<Dim>& k, double phase, double part) {
    const double amplitude = 0.08 * part;
    for (Eigen::Index i = 0; i < sphere.X.rows(); ++i) {
      const double angle = k.dot(sphere.X.row(i)) + phase;
      const double factor = 1 + amplitude * std::cos(angle);
      out.X.row(i) *= factor;
      log_gradient.row(i) -= amplitude * std::sin(angle) / factor * k.transpose();
    }
  });
  for (Eigen::Index i = 0; i < sphere.X.rows(); ++i) {
    const Vector<Dim> e = sphere.X.row(i), slope = log_gradient.row(i);
    out.normals.row(i) = (e - (slope - e * e.dot(slope))).normalized();
  }
  return out;
}

/// A smooth random function at the points, of order 1.
template <int Dim>
Eigen::VectorXd smooth_function(const Points<Dim>& X, unsigned seed) {
  return 0.5 + random_smooth_vectors<Dim>(X, seed).col(0).array();
}

/// The derivative of J in the direction W by central differences.
template <int Dim>
double first_difference(energy::ShapeEnergy<Dim>& J, const fem::Geometry<Dim>& shape,
                        const Points<Dim>& W, double step) {
  const double plus = J.try_move(shape.moved_to(shape.points() + step * W));
  return (plus - J.try_move(shape.moved_to(shape.points() - step * W))) / (2 * step);
}

/// The mixed second derivative of J(X + s V + t W).
template <int Dim>
double second_difference(energy::ShapeEnergy<Dim>& J, const fem::Geometry<Dim>& shape,
                         const Points<Dim>& V, const Points<Dim>& W, double step) {
  double sum = 0;
  for (const int s : {1, -1})
    for (const int t : {1, -1})
      sum += s * t * J.try_move(shape.moved_to(shape.points() + step * (s * V + t * W)));
  return sum / (4 * step * step);
}

/// |d2J(V, W) - difference quotient| / |d2J(V, W)|, root mean square over random smooth shapes and
/// normal velocities.
/// @param energy_of  the energy for a shape and its seed, to be reset
template <int Dim, class EnergyOf>
double second_derivative_error(int level, const EnergyOf& energy_of) {
  constexpr double kStep = 2e-3;  // truncation ~ kStep^2
  double errors = 0, scales = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const auto smooth = smooth_shape<Dim>(seed, level);
    const fem::Geometry<Dim> shape(smooth.X, smooth.T);
    const auto J = energy_of(shape, seed);
    J->reset(shape);
    const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
    energy::SecondDerivative<Dim> second(shape);
    J->differentiate_twice(fem::curvature<Dim>(shape, A), 1, second);
    const Eigen::VectorXd V = smooth_function<Dim>(smooth.X, 100 + seed),
                          W = smooth_function<Dim>(smooth.X, 200 + seed);
    const double exact = V.dot(second.times(shape, A, W));
    const double difference = second_difference<Dim>(*J, shape, V.asDiagonal() * smooth.normals,
                                                     W.asDiagonal() * smooth.normals, kStep);
    errors += std::pow(exact - difference, 2);
    scales += exact * exact;
  }
  return std::sqrt(errors / scales);
}

}  // namespace surf::test
