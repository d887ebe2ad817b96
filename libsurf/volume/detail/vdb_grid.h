// The scalar grid of a .vdb file as OpenVDB holds it; included by .cpp files only.
//
// The file is parsed here: OpenVDB 10's reader takes the sizes in a file for true and makes room
// for them, or goes on for as many entries. Of 1,800 mutations of files of 10 kB it asked for more
// than 8 GB at 282, and did not end within 20 s at one. Its reader in a child process would bound
// that, too, but cost the 60 ms that its libraries take to load for each file and a program that
// has to be found beside ours, and hide what a fuzzer has to see.
#pragma once

#include <openvdb/openvdb.h>

#include <Eigen/Geometry>
#include <string>
#include <variant>

namespace surf::volume {

using ScalarGrid = std::variant<openvdb::FloatGrid::Ptr, openvdb::DoubleGrid::Ptr,
                                openvdb::Int32Grid::Ptr, openvdb::Int64Grid::Ptr>;

struct VdbGrid {
  std::string name;
  std::string scalar_type;  ///< "float32", "float64", "int32", "int64"
  int n_grids = 1;          ///< in the file
  bool is_level_set = false;
  Eigen::Affine3d index_to_world = Eigen::Affine3d::Identity();
  ScalarGrid grid;  ///< without name and transform
};

/// The first scalar grid of the file; file format 222 to 224.
///
/// Takes at most 70 times as much memory as the file has bytes: a leaf has 64 bytes in the file,
/// and 4 kB for its doubles in memory, before their values are asked for.
/// @throws InputError  "path: what; what to do"
VdbGrid read_vdb_grid(const std::string& path);

}  // namespace surf::volume
