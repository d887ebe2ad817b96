// How many rows samples of a density have.
#pragma once

#include "libsurf/base/field.h"

namespace surf::energy {

/// Of the first and of the second derivatives at n points: n where they are asked for, else 0.
struct DerivativeRows {
  DerivativeRows(Eigen::Index n, Derivatives order)
      : first(order >= Derivatives::kFirst ? n : 0),
        second(order >= Derivatives::kSecond ? n : 0) {}
  Eigen::Index first, second;
};

}  // namespace surf::energy
