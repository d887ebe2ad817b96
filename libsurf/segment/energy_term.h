// Energies by name.
#pragma once

#include <map>
#include <span>
#include <string>

namespace surf::segment {

/// One term of the energy with its parameters by name; what is not given is chosen from the image
/// round the seeds. Areas and volumes are lengths and areas where an image is segmented.
///   minimal-surface  gamma0, gamma [1/mm], lambda [intensity/mm]: (5.1)
///   chan-vese        no parameters: 1.1.2, divided by the squared contrast
///   window           mean, half-width [intensity]: int_Omega of energy::intensity_window
///   mumford-shah     mu [mm^2], gamma [mm], contrast [intensity]: (5.4) with I / contrast,
///                    data-tolerance: of Alg. 8 on the domains, in the plane
///   area             beta of beta |Gamma| as `weight` [mm beside window or chan-vese]
struct EnergyTerm {
  std::string name;
  double weight = 1;
  std::map<std::string, double> parameters;
};

/// @throws UsageError  an energy or parameter is unknown or out of its range
void check_terms(std::span<const EnergyTerm> terms);

/// @throws UsageError  it is missing
double parameter(const EnergyTerm& term, const std::string& key);

}  // namespace surf::segment
