#include "libsurf/volume/detail/spline.h"

#include <cmath>

namespace surf::volume {

Kernel gaussian_kernel(double sigma) {
  if (sigma == 0) return {1.0};
  Kernel half(1 + static_cast<int>(std::ceil(3 * sigma)), 1.0);
  double sum = 1;
  for (std::size_t d = 1; d < half.size(); ++d) {
    half[d] = std::exp(-0.5 * d * d / (sigma * sigma));
    sum += 2 * half[d];
  }
  for (double& weight : half) weight /= sum;
  return half;
}

Kernel selective_kernel(double sigma) {
  Kernel half = gaussian_kernel(sigma);
  half.resize(1 + static_cast<int>(std::ceil(2 * sigma)));
  return half;
}

double side_weight(DerivativeFilter filter) {
  return filter == DerivativeFilter::kScharr ? 3.0 / 16 : 1.0 / 6;
}

}  // namespace surf::volume
