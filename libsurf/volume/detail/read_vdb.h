// OpenVDB: .vdb; in the library surf_vdb.
#pragma once

#include <string>

#include "libsurf/volume/read_volume.h"

namespace surf::volume {

extern "C" {
/// See read_volume.
/// @throws InputError
extern Volume (*const surf_read_vdb)(const std::string& path, const ReadOptions& options);
}

}  // namespace surf::volume
