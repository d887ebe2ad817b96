// Fields that energies are built from: constants and functions of another field.
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "libsurf/base/field.h"

namespace surf::energy {

/// The same value everywhere; with 1, BoundaryIntegral is the length or area.
template <int Dim>
std::shared_ptr<const Field<Dim>> constant_field(double value);

/// F(x) = phi(I(x)), phi given with its first and second derivative.
using Profile = std::function<std::array<double, 3>(double)>;
template <int Dim>
std::shared_ptr<const Field<Dim>> mapped_field(std::shared_ptr<const Field<Dim>> I, Profile phi);

/// Intensity window: f = (z^4 - 1) / (z^4 + 1), z = (I - mean) / half_width. Close to -1 well
/// inside mean +- half_width, 0 at its ends, close to 1 well outside: a smooth form of
/// clip(z^2 - 1, -1, 1). As the integrand of a DomainIntegral it lets a shape grow through
/// the window and stop at its ends; beside an area term of weight beta [mm] a neck of radius
/// under 2 beta is not passed, for the front there has curvature over 1/beta.
Profile intensity_window(double mean, double half_width);

}  // namespace surf::energy
