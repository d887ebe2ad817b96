#include "libcurve/image/image_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/volume/detail/spline.h"

namespace surf::curve {
namespace {

using volume::Kernel;
using Size = std::array<int, 2>;

/// Values at the pixels with a margin of copies of the border's, i fastest.
class Padded {
 public:
  Padded(const Size& size, int margin)
      : size_(size),
        margin_(margin),
        stride_(size[0] + 2 * margin),
        values_(std::size_t(stride_) * (size[1] + 2 * margin)) {}

  float* at(int i, int j) { return &values_[std::size_t(j + margin_) * stride_ + i + margin_]; }
  const float* at(int i, int j) const {
    return &values_[std::size_t(j + margin_) * stride_ + i + margin_];
  }
  int stride() const { return stride_; }
  const Size& size() const { return size_; }

  void fill_margin() {
    for (int j = 0; j < size_[1]; ++j) {
      std::fill(at(-margin_, j), at(0, j), *at(0, j));
      std::fill(at(size_[0], j), at(size_[0], j) + margin_, *at(size_[0] - 1, j));
    }
    for (int d = 1; d <= margin_; ++d) {
      std::copy_n(at(-margin_, 0), stride_, at(-margin_, -d));
      std::copy_n(at(-margin_, size_[1] - 1), stride_, at(-margin_, size_[1] - 1 + d));
    }
  }

 private:
  Size size_;
  int margin_, stride_;
  std::vector<float> values_;
};

Padded padded(const Size& size, const std::vector<float>& values, int margin) {
  Padded out(size, margin);
  for (int j = 0; j < size[1]; ++j)
    std::copy_n(values.data() + std::size_t(j) * size[0], size[0], out.at(0, j));
  out.fill_margin();
  return out;
}

/// Standard deviation along the index axes of a Gaussian of sigma_mm in the plane.
std::array<double, 2> sigma_in_pixels(const Image& image, double sigma_mm) {
  return {sigma_mm * image.plane_to_pixel().linear().row(0).norm(),
          sigma_mm * image.plane_to_pixel().linear().row(1).norm()};
}

std::vector<float> convolved(const Size& size, const std::vector<float>& values, int axis,
                             const Kernel& half) {
  const int radius = static_cast<int>(half.size()) - 1;
  const Padded in = padded(size, values, radius);
  const int step = axis == 0 ? 1 : in.stride();
  std::vector<float> out(values.size());
  std::vector<double> sums(size[0]);
  for (int j = 0; j < size[1]; ++j) {
    const float* centre = in.at(0, j);
    for (int i = 0; i < size[0]; ++i) sums[i] = half[0] * centre[i];
    for (int d = 1; d <= radius; ++d)
      for (int i = 0; i < size[0]; ++i)
        sums[i] += half[d] * (double(centre[i - d * step]) + centre[i + d * step]);
    std::copy(sums.begin(), sums.end(), out.begin() + std::ptrdiff_t(j) * size[0]);
  }
  return out;
}

/// The selective Gaussian blur of volume::SmoothingOptions.
std::vector<float> selected(const Size& size, const std::vector<float>& values,
                            const std::array<Kernel, 2>& half, double threshold) {
  const std::array<int, 2> radius = {int(half[0].size()) - 1, int(half[1].size()) - 1};
  const Padded in = padded(size, values, std::max(radius[0], radius[1]));
  std::vector<float> out;
  out.reserve(values.size());
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i) {
      const float centre = *in.at(i, j);
      double sum = 0, weights = 0;
      for (int b = -radius[1]; b <= radius[1]; ++b)
        for (int a = -radius[0]; a <= radius[0]; ++a) {
          const float value = *in.at(i + a, j + b);
          if (std::abs(value - centre) > threshold) continue;
          const double weight = half[0][std::abs(a)] * half[1][std::abs(b)];
          sum += weight * value;
          weights += weight;
        }
      out.push_back(static_cast<float>(sum / weights));
    }
  return out;
}

std::vector<float> smoothed(const Image& image, const volume::SmoothingOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  std::vector<float> values = image.values();
  const auto sigma = sigma_in_pixels(image, options.sigma_mm);
  const auto selective = sigma_in_pixels(image, options.selective_sigma_mm);
  if (options.selective_sigma_mm > 0)
    values =
        selected(image.size(), values,
                 {volume::selective_kernel(selective[0]), volume::selective_kernel(selective[1])},
                 options.selective_threshold);
  for (int axis = 0; axis < 2 && options.sigma_mm > 0; ++axis)
    values = convolved(image.size(), values, axis, volume::gaussian_kernel(sigma[axis]));
  return values;
}

/// A field on the pixels' grid, in either interpolation.
class GridField : public Field<2> {
 public:
  GridField(const Image& image, const std::vector<float>& values, Interpolation interpolation)
      : plane_to_pixel_(image.plane_to_pixel()),
        interpolation_(interpolation),
        nodes_(padded(image.size(), values, 2)) {}

  void sample(const Points<2>& x, Derivatives order, Samples<2>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index at = 0; at < x.rows(); ++at) sample_point(x.row(at), order, at, out);
  }

 private:
  void sample_point(const Vector<2>& x, Derivatives order, Eigen::Index at, Samples<2>& out) const {
    const Vector<2> u = plane_to_pixel_ * x;
    std::array<int, 2> cell;
    Vector<2> t, moves;  // moves: 0 where the constant continuation begins
    for (int axis = 0; axis < 2; ++axis) {
      const double clamped = std::clamp(u[axis], 0.0, nodes_.size()[axis] - 1.0);
      moves[axis] = clamped == u[axis] ? 1 : 0;
      cell[axis] = static_cast<int>(clamped);
      t[axis] = clamped - cell[axis];
    }
    double value;
    Vector<2> g = Vector<2>::Zero();
    Eigen::Matrix2d h = Eigen::Matrix2d::Zero();
    if (interpolation_ == Interpolation::kSpline)
      value = spline(nodes_.at(cell[0] - 1, cell[1] - 1), t, order, g, h);
    else
      value = linear(nodes_.at(cell[0], cell[1]), t, g, h);
    out.value[at] = value;
    if (order == Derivatives::kNone) return;
    const Eigen::Matrix2d& to_pixel = plane_to_pixel_.linear();
    out.gradient.row(at) = to_pixel.transpose() * g.cwiseProduct(moves);
    if (order == Derivatives::kFirst) return;
    const Eigen::Matrix2d plane =
        to_pixel.transpose() * moves.asDiagonal() * h * moves.asDiagonal() * to_pixel;
    out.hessian.row(at) << plane(0, 0), plane(0, 1), plane(1, 0), plane(1, 1);
  }

  double spline(const float* c, const Vector<2>& t, Derivatives order, Vector<2>& g,
                Eigen::Matrix2d& h) const {
    const volume::SplineWeights wx(t[0]), wy(t[1]);
    double value = 0;
    for (int j = 0; j < 4; ++j, c += nodes_.stride()) {
      const double row = volume::dot(wx.value, c);
      value += wy.value[j] * row;
      if (order == Derivatives::kNone) continue;
      const double row_x = volume::dot(wx.first, c);
      g += Vector<2>(wy.value[j] * row_x, wy.first[j] * row);
      if (order == Derivatives::kFirst) continue;
      h(0, 0) += wy.value[j] * volume::dot(wx.second, c);
      h(0, 1) += wy.first[j] * row_x;
      h(1, 1) += wy.second[j] * row;
    }
    h(1, 0) = h(0, 1);
    return value;
  }

  double linear(const float* c, const Vector<2>& t, Vector<2>& g, Eigen::Matrix2d& h) const {
    const double a = c[0], b = c[1], d = c[nodes_.stride()], e = c[nodes_.stride() + 1];
    const double twist = a - b - d + e;
    g = {b - a + t[1] * twist, d - a + t[0] * twist};
    h(0, 1) = h(1, 0) = twist;
    return a + t[0] * (b - a) + t[1] * (d - a) + t[0] * t[1] * twist;
  }

  Eigen::Affine2d plane_to_pixel_;
  Interpolation interpolation_;
  Padded nodes_;
};

/// Integral of the cubic B-spline field along the columns, from column 0.
class SplineIntegral : public Field<2> {
 public:
  SplineIntegral(const Image& image, const std::vector<float>& values)
      : plane_to_pixel_(image.plane_to_pixel()), nodes_(padded(image.size(), values, 2)) {
    const auto& size = image.size();
    for (int j = -1; j <= size[1] + 1; ++j) {
      double sum = 0;
      for (int i = 0; i < size[0]; ++i) {
        whole_.push_back(sum);
        const float* c = nodes_.at(i - 1, j);
        sum += (double(c[0]) + c[3]) / 24 + 11.0 / 24 * (double(c[1]) + c[2]);
      }
    }
  }

  void sample(const Points<2>& x, Derivatives, Samples<2>& out) const override {
    out.resize(x.rows(), Derivatives::kNone);
    for (Eigen::Index at = 0; at < x.rows(); ++at) out.value[at] = value(x.row(at));
  }

 private:
  double value(const Vector<2>& x) const {
    const Vector<2> u = plane_to_pixel_ * x;
    const auto& size = nodes_.size();
    const double at_u = std::clamp(u[0], 0.0, size[0] - 1.0),
                 at_v = std::clamp(u[1], 0.0, size[1] - 1.0);
    const int i = static_cast<int>(at_u), j = static_cast<int>(at_v);
    const double t = at_u - i, s = 1 - t, t2 = t * t, t3 = t2 * t, t4 = t2 * t2;
    // Integrals of the four weights from 0 to t.
    const std::array<double, 4> partial = {(1 - s * s * s * s) / 24,
                                           (0.75 * t4 - 2 * t3 + 4 * t) / 6,
                                           (t + 1.5 * t2 + t3 - 0.75 * t4) / 6, t4 / 24};
    const volume::SplineWeights wx(t), wy(at_v - j);
    double sum = 0;
    for (int d = 0; d < 4; ++d) {
      const float* c = nodes_.at(i - 1, j - 1 + d);
      const double before = whole_[std::size_t(j + d) * size[0] + i];
      // The constant continuation beyond the first and last column adds its share.
      sum += wy.value[d] *
             (before + volume::dot(partial, c) + (u[0] - at_u) * volume::dot(wx.value, c));
    }
    return sum;
  }

  Eigen::Affine2d plane_to_pixel_;
  Padded nodes_;
  std::vector<double> whole_;  // up to each column, rows -1 to size + 1
};

/// Gradient at pixel (i, j) along the index axes: differences, each averaged across.
Vector<2> index_gradient(const Padded& in, int i, int j, double side) {
  const std::array<double, 3> mean = {side, 1 - 2 * side, side};
  Vector<2> out = Vector<2>::Zero();
  for (int d = -1; d <= 1; ++d) {
    out[0] += mean[d + 1] * (double(*in.at(i + 1, j + d)) - *in.at(i - 1, j + d)) / 2;
    out[1] += mean[d + 1] * (double(*in.at(i + d, j + 1)) - *in.at(i + d, j - 1)) / 2;
  }
  return out;
}

}  // namespace

std::shared_ptr<const Field<2>> intensity_field(const Image& image, const FieldOptions& options) {
  return std::make_shared<const GridField>(image, smoothed(image, options.smoothing),
                                           options.interpolation);
}

std::shared_ptr<const Field<2>> intensity_antiderivative(const Image& image,
                                                         const FieldOptions& options) {
  return std::make_shared<const SplineIntegral>(image, smoothed(image, options.smoothing));
}

std::shared_ptr<const Field<2>> edge_indicator(const Image& image, const FieldOptions& options,
                                               double lambda) {
  if (!(lambda > 0) || !std::isfinite(lambda))
    throw UsageError(fmt::format("edge_indicator: lambda = {} violates > 0", lambda));
  const Padded I = padded(image.size(), smoothed(image, options.smoothing), 1);
  const Eigen::Matrix2d scaled = image.plane_to_pixel().linear().transpose() / lambda;
  const double side = volume::side_weight(options.filter);
  std::vector<float> H;
  H.reserve(image.n_pixels());
  for (int j = 0; j < image.size()[1]; ++j)
    for (int i = 0; i < image.size()[0]; ++i)
      H.push_back(
          static_cast<float>(1 / (1 + (scaled * index_gradient(I, i, j, side)).squaredNorm())));
  return std::make_shared<const GridField>(image, H, options.interpolation);
}

}  // namespace surf::curve
