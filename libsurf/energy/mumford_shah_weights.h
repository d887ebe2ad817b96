// The weights of the Mumford-Shah model, in the plane and on volumes.
#pragma once

namespace surf {

class OptionChecks;

namespace energy {

struct MumfordShahWeights {
  double mu = 1;        ///< [mm^2], > 0: u follows I over lengths above sqrt(mu)
  double gamma = 0;     ///< [mm], >= 0: weight of the length or area
  double contrast = 1;  ///< intensities are divided by it, > 0

  void check(OptionChecks& checks) const;
};

}  // namespace energy
}  // namespace surf
