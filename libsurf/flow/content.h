// The content, area or volume, of a domain: what a constrained flow keeps.
#pragma once

#include "libsurf/base/types.h"

namespace surf::flow {

/// Content of the domain within the elements [mm^Dim]; that of fem::Geometry::enclosed().
template <int Dim>
double content(const Points<Dim>& X, const Elements<Dim>& T);

/// Its derivative by the vertices, (n, Dim) [mm^(Dim-1)]: row i is lumped mass times nodal normal.
template <int Dim>
Points<Dim> content_gradient(const Points<Dim>& X, const Elements<Dim>& T);

/// Moves X by s * direction, with the s next to 0 for which the content is `target` to rounding, a
/// root of a polynomial of degree Dim, by Newton's method. No vertex moves further than `longest`:
/// then, and where the direction does not change the content and X stays, it is still different.
/// @param direction  (n, Dim)
/// @return whether the content is `target` now
template <int Dim>
bool correct_content(Points<Dim>& X, const Elements<Dim>& T, const Points<Dim>& direction,
                     double target, double longest);

}  // namespace surf::flow
