// What an extent says of the values of its image.
#pragma once

#include "libsurf/segment/setting.h"

namespace surf::segment {

/// Where they usually lie, from lines that are spread over the image, and what of it was scanned.
template <int Dim>
void look_at_values(const Setting<Dim>& setting, ImageExtent<Dim>& extent);

}  // namespace surf::segment
