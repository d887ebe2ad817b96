// Curves to a file, once they are finished (libsurf/segment/finish.h).
#pragma once

#include <string>

#include "libcurve/image/image.h"
#include "libsurf/io/space.h"
#include "libsurf/segment/finish.h"

namespace surf::curve {

/// write_contours(), for results only: what was not finished cannot be written by mistake.
/// @throws UsageError, OutputError
void write(const std::string& path, const segment::Finished<2>& curves, const Image& image,
           io::Space space = io::Space::kLps);

}  // namespace surf::curve
