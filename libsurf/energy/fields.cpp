#include "libsurf/energy/fields.h"

namespace surf::energy {
namespace {

template <int Dim>
class ConstantField : public Field<Dim> {
 public:
  explicit ConstantField(double value) : value_(value) {}
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    out.value.setConstant(value_);
    out.gradient.setZero();
    out.hessian.setZero();
  }

 private:
  double value_;
};

template <int Dim>
class MappedField : public Field<Dim> {
 public:
  MappedField(std::shared_ptr<const Field<Dim>> I, Profile phi)
      : I_(std::move(I)), phi_(std::move(phi)) {}

  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    I_->sample(x, order, out);
    for (Eigen::Index at = 0; at < x.rows(); ++at) {
      const auto [value, first, second] = phi_(out.value[at]);
      out.value[at] = value;
      if (order == Derivatives::kNone) continue;
      const Vector<Dim> gradient = out.gradient.row(at);
      out.gradient.row(at) *= first;
      if (order == Derivatives::kFirst) continue;
      Eigen::Map<Eigen::Matrix<double, Dim, Dim>> hessian(out.hessian.row(at).data());
      hessian = first * hessian + second * gradient * gradient.transpose();
    }
  }

 private:
  std::shared_ptr<const Field<Dim>> I_;
  Profile phi_;
};

}  // namespace

template <int Dim>
std::shared_ptr<const Field<Dim>> constant_field(double value) {
  return std::make_shared<const ConstantField<Dim>>(value);
}

template <int Dim>
std::shared_ptr<const Field<Dim>> mapped_field(std::shared_ptr<const Field<Dim>> I, Profile phi) {
  return std::make_shared<const MappedField<Dim>>(std::move(I), std::move(phi));
}

Profile intensity_window(double mean, double half_width) {
  return [=](double I) {
    const double z = (I - mean) / half_width;
    const double z2 = z * z, z3 = z2 * z, z4 = z2 * z2;
    const double p = 1 / (z4 + 1);
    // f = 1 - 2 p; p' = -4 z^3 p^2; p'' = -12 z^2 p^2 + 32 z^6 p^3
    const double first = 8 * z3 * p * p;
    const double second = 24 * z2 * p * p - 64 * z3 * z3 * p * p * p;
    return std::array<double, 3>{1 - 2 * p, first / half_width, second / (half_width * half_width)};
  };
}

template std::shared_ptr<const Field<2>> constant_field<2>(double);
template std::shared_ptr<const Field<3>> constant_field<3>(double);
template std::shared_ptr<const Field<2>> mapped_field<2>(std::shared_ptr<const Field<2>>, Profile);
template std::shared_ptr<const Field<3>> mapped_field<3>(std::shared_ptr<const Field<3>>, Profile);

}  // namespace surf::energy
