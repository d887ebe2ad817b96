// Files for the tests of readers and writers: a scratch folder, grids that are oblique, mirrored
// and sheared, values that tell every voxel from its neighbours, and headers byte by byte.
#pragma once

#include <nifti/nifti1.h>
#include <nifti/nifti2.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/volume.h"
#include "tests/surf/io/scratch_folder.h"

namespace surf::volume {

using Files = test::ScratchFolder;

/// Calls check(name, a value of the C++ type, our name of it) for each type of scalars.
/// @param names  of a format, in the order of this list
template <class Check>
void check_scalar_types(const std::array<const char*, 10>& names, const Check& check) {
  check(names[0], std::int8_t(), "int8");
  check(names[1], std::uint8_t(), "uint8");
  check(names[2], std::int16_t(), "int16");
  check(names[3], std::uint16_t(), "uint16");
  check(names[4], std::int32_t(), "int32");
  check(names[5], std::uint32_t(), "uint32");
  check(names[6], std::int64_t(), "int64");
  check(names[7], std::uint64_t(), "uint64");
  check(names[8], float(), "float32");
  check(names[9], double(), "float64");
}

/// The message of the InputError that reading throws; "" if it reads.
inline std::string failure(const std::string& path, const ReadOptions& options = {}) {
  try {
    read_volume(path, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

struct Grid {
  std::string name;
  std::array<int, 3> size;
  Eigen::Affine3d index_to_world;

  std::size_t n_voxels() const { return std::size_t(size[0]) * size[1] * size[2]; }
};

inline Eigen::Affine3d affine(const Eigen::Matrix3d& linear, const Eigen::Vector3d& translation) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.linear() = linear;
  result.translation() = translation;
  return result;
}

/// Three different sizes, so that no swapped axis goes unseen; sizes beyond one OpenVDB leaf.
inline std::vector<Grid> grids() {
  const Eigen::Matrix3d oblique =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix() *
      Eigen::Vector3d(0.8, 1.1, 2.5).asDiagonal();
  const Eigen::Matrix3d mirrored = oblique * Eigen::Vector3d(-1, 1, 1).asDiagonal();
  Eigen::Matrix3d sheared = oblique;
  sheared.col(2) += 0.3 * sheared.col(1);
  return {{"oblique", {11, 9, 10}, affine(oblique, {-12.5, 30.25, 7})},
          {"mirrored", {3, 17, 6}, affine(mirrored, {100, -20, 3.5})},
          {"sheared", {5, 4, 19}, affine(sheared, {-3, -2, -1})}};
}

/// A whole number from 0 to 99 that differs between neighbours along every axis.
inline int value_at(int i, int j, int k) { return (7 * i + 31 * j + 57 * k) % 100; }

template <class T = float>
std::vector<T> values(const std::array<int, 3>& size, int offset = 0) {
  std::vector<T> result;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        result.push_back(static_cast<T>(value_at(i, j, k) + offset));
  return result;
}

inline Volume volume_of(const Grid& grid) {
  return Volume(grid.size, grid.index_to_world, values(grid.size));
}

/// Files keep matrices as floats or in decimals of that precision; our lengths are below 128.
constexpr double kFloatTolerance = 128 * 1.2e-7;

/// Same size, affine, and value = slope * value_at + intercept at every voxel.
inline void expect_volume(const Volume& volume, const Grid& grid, double slope = 1,
                          double intercept = 0) {
  ASSERT_EQ(volume.size(), grid.size);
  EXPECT_LT((volume.index_to_world().matrix() - grid.index_to_world.matrix()).cwiseAbs().maxCoeff(),
            kFloatTolerance)
      << volume.index_to_world().matrix();
  int n_wrong = 0;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        n_wrong +=
            volume.value(i, j, k) != static_cast<float>(slope * value_at(i, j, k) + intercept);
  EXPECT_EQ(n_wrong, 0) << "of " << grid.n_voxels() << " voxels";
}

template <class T>
void turn_bytes(T& value) {
  auto* bytes = reinterpret_cast<unsigned char*>(&value);
  std::reverse(bytes, bytes + sizeof value);
}

template <class T>
std::string raw_bytes(const std::vector<T>& data, bool is_swapped = false) {
  std::string bytes;
  for (T value : data) {
    if (is_swapped) turn_bytes(value);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

/// A NIfTI header (nifti_1_header or nifti_2_header) of one frame of int16 with an sform.
template <class Header>
Header nifti_header(const Grid& grid) {
  constexpr bool is_first = std::is_same_v<Header, nifti_1_header>;
  Header header = {};
  header.sizeof_hdr = sizeof(Header);
  header.dim[0] = 3;
  header.pixdim[0] = 1;
  for (int axis = 1; axis < 8; ++axis) header.dim[axis] = 1;
  for (int axis = 0; axis < 3; ++axis) {
    header.dim[axis + 1] = static_cast<std::int16_t>(grid.size[axis]);
    header.pixdim[axis + 1] = static_cast<float>(grid.index_to_world.linear().col(axis).norm());
  }
  header.datatype = NIFTI_TYPE_INT16;
  header.bitpix = 16;
  header.vox_offset = sizeof(Header) + 4;
  header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
  for (int column = 0; column < 4; ++column) {
    header.srow_x[column] = static_cast<float>(grid.index_to_world.matrix()(0, column));
    header.srow_y[column] = static_cast<float>(grid.index_to_world.matrix()(1, column));
    header.srow_z[column] = static_cast<float>(grid.index_to_world.matrix()(2, column));
  }
  std::memcpy(header.magic, is_first ? "n+1\0" : "n+2\0\r\n\032\n", sizeof header.magic);
  return header;
}

/// Every number of the header in the other byte order.
template <class Header>
void turn_header(Header& header) {
  turn_bytes(header.sizeof_hdr);
  for (auto& value : header.dim) turn_bytes(value);
  for (auto& value : header.pixdim) turn_bytes(value);
  for (auto* row : {header.srow_x, header.srow_y, header.srow_z})
    for (int n = 0; n < 4; ++n) turn_bytes(row[n]);
  turn_bytes(header.datatype);
  turn_bytes(header.bitpix);
  turn_bytes(header.vox_offset);
  turn_bytes(header.scl_slope);
  turn_bytes(header.scl_inter);
  turn_bytes(header.qform_code);
  turn_bytes(header.sform_code);
}

template <class Header>
std::string nifti_bytes(const Header& header, const std::string& data) {
  return std::string(reinterpret_cast<const char*>(&header), sizeof header) + std::string(4, '\0') +
         data;
}

}  // namespace surf::volume
