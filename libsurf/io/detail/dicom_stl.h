// DICOM Encapsulated STL; in the library surf_dicom.
#pragma once

#include <string>

#include "libsurf/io/write_surface.h"

namespace surf::io {

extern "C" {
/// The bytes of an Encapsulated STL object (part 3, A.85.1): a binary STL file in LPS mm, whatever
/// options.space is, in the frame of reference of the series, of whose images it says that it was
/// made.
/// @throws InputError   options.dicom is missing
/// @throws OutputError  DCMTK refuses something; it was not there to build
extern std::string (*const surf_dicom_stl)(const std::string& path, const Triangles& surface,
                                           const WriteOptions& options);
}

}  // namespace surf::io
