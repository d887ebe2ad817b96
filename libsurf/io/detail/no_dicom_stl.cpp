// In place of dicom_stl.cpp where DCMTK is missing.
#include "libsurf/base/error.h"
#include "libsurf/io/detail/dicom_stl.h"

namespace surf::io {
namespace {

std::string refuse(const std::string& path, const Triangles&, const WriteOptions&) {
  throw OutputError(path + ": not written: this surfseg was built without DCMTK");
}

}  // namespace

extern "C" {
std::string (*const surf_dicom_stl)(const std::string&, const Triangles&,
                                    const WriteOptions&) = refuse;
}

}  // namespace surf::io
