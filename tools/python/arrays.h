// Between numpy's arrays and the library's.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <string>
#include <vector>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surfseg::python {

namespace py = pybind11;

/// A volume of an array indexed [i, j, k] of any real type; slices are converted one by one, so
/// that the volume's own 4 bytes a voxel are the only copy.
/// @param affine  (4, 4), voxel index -> RAS mm
/// @throws surf::UsageError  the array has no three dimensions or holds no real numbers, the affine
///                           is not 4 x 4
/// @throws surf::InputError  as volume::Volume::Builder
surf::volume::Volume volume_of(const py::array& values, const py::array& affine,
                               const std::string& name);

/// The values indexed [i, j, k], float32, a copy.
py::array_t<float> values_of(const surf::volume::Volume& volume);

/// (4, 4), voxel index -> RAS mm.
py::array_t<double> affine_of(const surf::volume::Volume& volume);

/// An image of an array indexed [row, column] of any real type, row 0 on top.
/// @throws surf::UsageError  the array has no two dimensions or holds no real numbers
/// @throws surf::InputError  as curve::Image, a spacing that is not positive
surf::curve::Image image_of(const py::array& values, const std::array<double, 2>& spacing_mm,
                            const std::string& name);

/// The values indexed [row, column], float32, a copy.
py::array_t<float> values_of(const surf::curve::Image& image);

/// A point (x, y, z), or (x, y) in an image.
/// @throws surf::UsageError  not Dim finite numbers
template <int Dim>
surf::Vector<Dim> point_of(const std::vector<double>& point, const std::string& what);

/// The rows of a matrix as an array that shares its memory, read-only, and keeps `owner` alive.
template <class Matrix>
py::array rows_of(const Matrix& matrix, py::handle owner) {
  using Scalar = typename Matrix::Scalar;
  py::array_t<Scalar> out(
      {py::ssize_t(matrix.rows()), py::ssize_t(matrix.cols())},
      {py::ssize_t(matrix.cols() * sizeof(Scalar)), py::ssize_t(sizeof(Scalar))}, matrix.data(),
      owner);
  out.attr("setflags")(py::arg("write") = false);
  return out;
}

}  // namespace surfseg::python
