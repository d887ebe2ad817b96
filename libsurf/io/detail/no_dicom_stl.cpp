// In place of dicom_stl.cpp where DCMTK is missing.
#include "libsurf/base/error.h"
#include "libsurf/io/detail/dicom_stl.h"

namespace surf::io {

std::string dicom_stl_bytes(const std::string& path, const Triangles&, const WriteOptions&) {
  throw OutputError(path + ": not written: this surfseg was built without DCMTK");
}

}  // namespace surf::io
