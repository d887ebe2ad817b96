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
///   volume           |Omega|; weight [1/mm beside area], < 0 grows
///   anisotropic      x, y, z: int_Gamma H sqrt((x nu_x)^2 + (y nu_y)^2 + (z nu_z)^2) dS, H = 1 or,
///                    with lambda, the edge indicator: (1.7)
///   alignment        scale [intensity/mm], sign: int_Gamma phi(<grad I, nu>) dS with
///                    phi = sign s / scale, 1 for bright objects and -1 for dark ones; with sign =
///                    0 edges of either sign (energy::absolute_alignment)
///   willmore         curvature [1/mm]: 1/2 int_Gamma (kappa - curvature)^2 dS, kappa the sum
///                    of the principal curvatures
///   prescribed-curvature  curvature, lambda: the same, weighted by the edge indicator: (1.8)
///   average-edge     lambda: the mean of the edge indicator along Gamma, (1.9)
///   average-alignment  scale, sign: the mean of phi
///   region-competition  no parameters: means and variances of both sides, (1.10)
struct EnergyTerm {
  std::string name;
  double weight = 1;
  std::map<std::string, double> parameters;
};

/// The names of all energies: "area, chan-vese, ... and window".
std::string known_energies();

/// Whether a run with these terms ends on the edges that it finds: the minimisers of the other
/// energies are what was asked for.
bool settles_on_edges(std::span<const EnergyTerm> terms);

/// @throws UsageError  an energy or parameter is unknown or out of its range
void check_terms(std::span<const EnergyTerm> terms);

bool has_mumford_shah(std::span<const EnergyTerm> terms);

/// @throws UsageError  it is missing
double parameter(const EnergyTerm& term, const std::string& key);

}  // namespace surf::segment
