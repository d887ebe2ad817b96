#include "libsurf/io/detail/gifti_file.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cstdint>
#include <new>

#include "libsurf/base/base64.h"
#include "libsurf/base/escaped.h"
#include "libsurf/io/detail/numbers.h"

namespace surf::io {
namespace {

using Floats = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Integers = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

std::string base64_of_compressed(const void* data, std::size_t n_bytes) {
  uLongf n_compressed = compressBound(n_bytes);
  std::string compressed(n_compressed, '\0');
  if (compress2(reinterpret_cast<Bytef*>(compressed.data()), &n_compressed,
                static_cast<const Bytef*>(data), n_bytes, Z_DEFAULT_COMPRESSION) != Z_OK)
    throw std::bad_alloc();
  compressed.resize(n_compressed);
  return base64(compressed);
}

std::string meta_data(const std::string& key, const std::string& value) {
  return fmt::format("<MetaData><MD><Name>{}</Name><Value>{}</Value></MD></MetaData>\n", key,
                     escaped(value, {{'&', "&amp;"}, {'<', "&lt;"}}));
}

/// @param type  of NIfTI: FLOAT32 or INT32, both of four bytes
std::string data_array(const std::string& intent, const std::string& type, Eigen::Index n_rows,
                       Eigen::Index n_columns, const void* data, const std::string& inner) {
  const std::string shape =
      n_columns == 1
          ? fmt::format("Dimensionality=\"1\" Dim0=\"{}\"", n_rows)
          : fmt::format("Dimensionality=\"2\" Dim0=\"{}\" Dim1=\"{}\"", n_rows, n_columns);
  return fmt::format(
      "<DataArray Intent=\"NIFTI_INTENT_{}\" DataType=\"NIFTI_TYPE_{}\" "
      "ArrayIndexingOrder=\"RowMajorOrder\" {} Encoding=\"GZipBase64Binary\" "
      "Endian=\"LittleEndian\" ExternalFileName=\"\" ExternalFileOffset=\"\">\n{}<Data>{}</Data>\n"
      "</DataArray>\n",
      intent, type, shape, inner, base64_of_compressed(data, std::size_t(n_rows * n_columns) * 4));
}

std::string file_of(int n_arrays, const std::string& arrays) {
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<!DOCTYPE GIFTI SYSTEM \"http://www.nitrc.org/frs/download.php/115/gifti.dtd\">\n"
      "<GIFTI Version=\"1.0\" NumberOfDataArrays=\"{}\">\n{}<LabelTable/>\n{}</GIFTI>\n",
      n_arrays, meta_data("Generator", "surfseg"), arrays);
}

}  // namespace

std::string gifti_surface_bytes(const Triangles& surface) {
  const Floats points = surface.points.cast<float>();
  const Integers triangles = surface.elements.cast<std::int32_t>();
  const std::string frame =
      "<CoordinateSystemTransformMatrix>\n"
      "<DataSpace>NIFTI_XFORM_SCANNER_ANAT</DataSpace>\n"
      "<TransformedSpace>NIFTI_XFORM_SCANNER_ANAT</TransformedSpace>\n"
      "<MatrixData>\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n</MatrixData>\n"
      "</CoordinateSystemTransformMatrix>\n";
  return file_of(2, data_array("POINTSET", "FLOAT32", points.rows(), 3, points.data(),
                               meta_data("GeometricType", "Reconstruction") + frame) +
                        data_array("TRIANGLE", "INT32", triangles.rows(), 3, triangles.data(),
                                   meta_data("TopologicalType", "Closed")));
}

std::string gifti_shape_bytes(const std::vector<PointArray>& arrays) {
  std::string out;
  for (const PointArray& array : arrays) {
    const Eigen::VectorXf values = array.values.cast<float>();
    out += data_array("SHAPE", "FLOAT32", values.size(), 1, values.data(),
                      meta_data("Name", array.name));
  }
  return file_of(int(arrays.size()), out);
}

}  // namespace surf::io
