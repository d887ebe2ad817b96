#include "libsurf/energy/chan_vese.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "libsurf/fem/quadrature.h"

namespace surf::energy {
namespace {

constexpr int kAntiderivativeOrder = 4;  // P is smoother than I
// P holds all of the intensities along its line up to a point, those far from the shape, too, which
// cancel only as far as the rule resolves them: longer elements are integrated in parts.
constexpr double kLongestPart = 4;  // in spacings of the lines
constexpr int kMostParts = 16;      // of a side

/// The rule on each of the parts that come of dividing every side into n.
template <int Dim>
fem::Quadrature<Dim> in_parts(const fem::Quadrature<Dim>& rule, int n) {
  using Corners = Eigen::Matrix<double, Dim, Dim>;  // of a part, barycentric
  std::vector<Corners> parts;
  if constexpr (Dim == 2) {
    for (int i = 0; i < n; ++i) {
      Corners part;
      part << n - i, i, n - i - 1, i + 1;
      parts.push_back(part);
    }
  } else {
    const auto corner = [n](int i, int j) { return Eigen::RowVector3d(n - i - j, i, j); };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        Corners part;
        part << corner(i, j), corner(i + 1, j), corner(i, j + 1);
        parts.push_back(part);
        if (i + j + 1 == n) continue;
        part << corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1);
        parts.push_back(part);
      }
  }
  fem::Quadrature<Dim> out;
  out.points.resize(rule.size() * std::ssize(parts), Dim);
  out.weights = rule.weights.replicate(std::ssize(parts), 1) / double(parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k)
    out.points.middleRows(Eigen::Index(k) * rule.size(), rule.size()) = rule.points * parts[k] / n;
  return out;
}

/// Elements by the number of parts of their sides, for parts of at most so many mm.
template <int Dim>
std::map<int, std::vector<Eigen::Index>> by_parts(const fem::Geometry<Dim>& shape,
                                                  double longest_mm) {
  std::map<int, std::vector<Eigen::Index>> out;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    double length = 0;
    for (int i = 0; i < Dim; ++i)
      length = std::max(length, (shape.points().row(shape.elements()(t, i)) -
                                 shape.points().row(shape.elements()(t, (i + 1) % Dim)))
                                    .norm());
    const double n = std::ceil(length / longest_mm);
    out[int(std::clamp(n, 1.0, double(kMostParts)))].push_back(t);
  }
  return out;
}

void one_and_value(const Eigen::VectorXd& value, Eigen::MatrixXd& out) {
  out.col(0).setOnes();
  out.col(1) = value;
}

}  // namespace

template <int Dim>
ChanVese<Dim>::ChanVese(std::shared_ptr<const Field<Dim>> I, const ImageTotals& totals,
                        const ChanVeseOptions& options,
                        const std::optional<Antiderivative<Dim>>& antiderivative)
    : RegionEnergy<Dim>(std::move(I), one_and_value, 2,
                        {options.quadrature_order, options.ray_spacing_mm}),
      antiderivative_(antiderivative),
      totals_(totals),
      squared_scale_(options.intensity_scale * options.intensity_scale) {}

template <int Dim>
Eigen::VectorXd ChanVese<Dim>::integrals_over(const fem::Geometry<Dim>& shape) const {
  if (!antiderivative_) return RegionEnergy<Dim>::integrals_over(shape);
  Samples<Dim> samples;
  double sum = 0;
  for (const auto& [n, elements] : by_parts(shape, kLongestPart * antiderivative_->spacing_mm)) {
    const auto rule = in_parts(fem::quadrature<Dim>(kAntiderivativeOrder), n);
    antiderivative_->P->sample(
        fem::quadrature_points<Dim>(shape.points(), shape.elements()(elements, Eigen::all),
                                    rule.points),
        Derivatives::kNone, samples);
    for (std::size_t k = 0; k < elements.size(); ++k) {
      const Eigen::Index t = elements[k];
      const double flux =
          shape.measures()[t] * shape.normals().row(t).dot(antiderivative_->direction);
      for (Eigen::Index q = 0; q < rule.size(); ++q)
        sum += flux * rule.weights[q] * samples.value[Eigen::Index(k) * rule.size() + q];
    }
  }
  return Eigen::Vector2d(shape.enclosed(), sum);
}

template <int Dim>
Eigen::VectorXd ChanVese<Dim>::change_between(const fem::Geometry<Dim>& from,
                                              const fem::Geometry<Dim>& to) const {
  if (!antiderivative_) return RegionEnergy<Dim>::change_between(from, to);
  return integrals_over(to) - integrals_over(from);
}

template <int Dim>
std::array<double, 2> ChanVese<Dim>::means() const {
  const Eigen::VectorXd& inside = this->integrals();
  return {inside[1] / inside[0], (totals_.intensity - inside[1]) / (totals_.content - inside[0])};
}

template <int Dim>
double ChanVese<Dim>::value_of(const Eigen::VectorXd& inside) const {
  const double outside_content = totals_.content - inside[0];
  const double outside_intensity = totals_.intensity - inside[1];
  const double J = totals_.intensity_squared - inside[1] * inside[1] / inside[0] -
                   outside_intensity * outside_intensity / outside_content;
  return J / squared_scale_;
}

template <int Dim>
std::function<std::array<double, 2>(double)> ChanVese<Dim>::density() const {
  const auto [mu_1, mu_2] = means();
  return [scale = 1 / squared_scale_, mu_1 = mu_1, mu_2 = mu_2](double I) {
    const double a = I - mu_1, b = I - mu_2;
    return std::array<double, 2>{scale * (a * a - b * b), scale * 2 * (a - b)};
  };
}

template <int Dim>
Eigen::MatrixXd ChanVese<Dim>::second_of_integrals() const {
  const auto [mu_1, mu_2] = means();
  const double a = 1 / this->integrals()[0], b = 1 / (totals_.content - this->integrals()[0]);
  const double mixed = mu_1 * a + mu_2 * b;
  Eigen::Matrix2d D2J;  // with respect to V_1 and S_1
  D2J << -(mu_1 * mu_1 * a + mu_2 * mu_2 * b), mixed, mixed, -(a + b);
  return 2 / squared_scale_ * D2J;
}

template class ChanVese<2>;
template class ChanVese<3>;

}  // namespace surf::energy
