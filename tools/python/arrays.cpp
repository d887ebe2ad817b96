#include "tools/python/arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "libsurf/base/error.h"

namespace surfseg::python {
namespace {

Eigen::Matrix4d matrix_of(const py::array& affine) {
  if (affine.ndim() != 2 || affine.shape(0) != 4 || affine.shape(1) != 4)
    throw surf::UsageError("affine: expected a 4 x 4 matrix, voxel index to RAS mm");
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>(affine);
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
}

constexpr py::ssize_t kMostAlongAnAxis = 1 << 20;

void check_type(const py::array& values) {
  const char kind = values.dtype().kind();
  if (std::string("biuf").find(kind) == std::string::npos)
    throw surf::UsageError(fmt::format("image: expected real numbers; got the type '{}'",
                                       std::string(py::str(values.dtype()))));
}

}  // namespace

surf::volume::Volume volume_of(const py::array& values, const py::array& affine,
                               const std::string& name) {
  if (values.ndim() != 3)
    throw surf::UsageError(fmt::format(
        "image: expected an array of three dimensions, indexed [i, j, k]; got {}", values.ndim()));
  check_type(values);
  std::array<int, 3> size;
  for (int axis = 0; axis < 3; ++axis) {
    if (values.shape(axis) > kMostAlongAnAxis)
      throw surf::UsageError(fmt::format("image: {} voxels along an axis", values.shape(axis)));
    size[axis] = int(values.shape(axis));
  }
  surf::volume::Source source;
  source.path = name;
  source.format = "array";
  source.scalar_type = py::str(values.dtype().attr("name"));  // in either order of bytes
  source.orientation_source = "affine";
  surf::volume::Volume::Builder builder(size, matrix_of(affine), source);
  for (int k = 0; k < size[2]; ++k) {
    const py::array_t<float, py::array::f_style | py::array::forcecast> slice(
        values[py::make_tuple(py::ellipsis(), k)]);
    builder.append_slice({slice.data(), std::size_t(slice.size())});
  }
  return builder.finish();
}

py::array_t<float> values_of(const surf::volume::Volume& volume) {
  py::array_t<float, py::array::f_style> out(volume.size());
  volume.copy_box({0, 0, 0}, volume.size(), out.mutable_data());
  return out;
}

py::array_t<double> affine_of(const surf::volume::Volume& volume) {
  py::array_t<double> out({4, 4});
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      out.mutable_at(row, column) = volume.index_to_world().matrix()(row, column);
  return out;
}

surf::curve::Image image_of(const py::array& values, const std::array<double, 2>& spacing_mm,
                            const std::string& name) {
  if (values.ndim() != 2)
    throw surf::UsageError(
        fmt::format("image: expected an array of two dimensions, indexed [row, column]; got {}",
                    values.ndim()));
  check_type(values);
  if (!(spacing_mm[0] > 0 && spacing_mm[1] > 0))
    throw surf::InputError("spacing: expected positive lengths of a pixel [mm]");
  for (int axis = 0; axis < 2; ++axis)
    if (values.shape(axis) > kMostAlongAnAxis)
      throw surf::UsageError(fmt::format("image: {} pixels along an axis", values.shape(axis)));
  const py::array_t<float, py::array::c_style | py::array::forcecast> rows(values);
  surf::curve::ImageSource source;
  source.path = name;
  source.format = "array";
  source.scalar_type = py::str(values.dtype().attr("name"));  // in either order of bytes
  source.spacing_source = "options";
  return {{int(values.shape(1)), int(values.shape(0))},
          surf::curve::pixel_to_plane({spacing_mm[0], spacing_mm[1]}),
          std::vector<float>(rows.data(), rows.data() + rows.size()),
          source};
}

py::array_t<float> values_of(const surf::curve::Image& image) {
  py::array_t<float> out({image.size()[1], image.size()[0]});
  std::copy(image.values().begin(), image.values().end(), out.mutable_data());
  return out;
}

template <int Dim>
surf::Vector<Dim> point_of(const std::vector<double>& point, const std::string& what) {
  if (point.size() != Dim ||
      !std::all_of(point.begin(), point.end(), [](double x) { return std::isfinite(x); }))
    throw surf::UsageError(fmt::format("{}: expected points of {} finite numbers {}", what,
                                       Dim == 3 ? "three" : "two",
                                       Dim == 3 ? "(x, y, z)" : "(x, y)"));
  return Eigen::Map<const surf::Vector<Dim>>(point.data());
}

template surf::Vector<2> point_of<2>(const std::vector<double>&, const std::string&);
template surf::Vector<3> point_of<3>(const std::vector<double>&, const std::string&);

}  // namespace surfseg::python
