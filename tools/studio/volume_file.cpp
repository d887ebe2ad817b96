#include "tools/studio/volume_file.h"

#include <nifti/nifti1.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "tools/studio/gzip.h"

namespace surfseg::studio {
namespace {

using surf::volume::Volume;

constexpr double kMostBytes = 512e6;
constexpr int kMostVoxels = 2048;  // along an axis, of the 3-D textures of common graphics
constexpr std::array<double, 2> kSoftTissue = {-160, 240}, kThorax = {-1050, 350};  // HU
// Lung that holds air [HU], and of how much of a scan on it is one of the thorax.
constexpr std::array<double, 2> kLung = {-900, -600};
constexpr double kShareOfLung = 0.1;  // 0.14 and 0.30 of two of the thorax, 0.03 of an abdomen
constexpr double kCut = 1e-3;         // of the voxels, at both ends of a window: a tumour is more
constexpr int kSamples = 40;          // along each axis, for percentiles
constexpr double kSteps = 65000;

bool is_whole(float value) { return value == std::floor(value); }

/// Every so many voxels.
std::vector<float> samples_of(const Volume& volume) {
  std::vector<float> out;
  const auto& size = volume.size();
  std::array<int, 3> stride;
  for (int axis = 0; axis < 3; ++axis) stride[axis] = std::max(1, size[axis] / kSamples);
  for (int k = 0; k < size[2]; k += stride[2])
    for (int j = 0; j < size[1]; j += stride[1])
      for (int i = 0; i < size[0]; i += stride[0]) out.push_back(volume.value(i, j, k));
  return out;
}

std::array<int, 3> coarser_size(const Volume& volume, const std::array<int, 3>& coarser_by) {
  std::array<int, 3> out;
  for (int axis = 0; axis < 3; ++axis)
    out[axis] = (volume.size()[axis] + coarser_by[axis] - 1) / coarser_by[axis];
  return out;
}

/// Slices of a volume, or of means of blocks of it: of the voxels whose centres lie in a block.
/// The blocks are all alike, also where no whole number of voxels is as long as one of them: a last
/// one of fewer voxels would reach beyond the volume.
class Slices {
 public:
  Slices(const Volume& volume, const std::array<int, 3>& coarser_by)
      : volume_(volume), size_(coarser_size(volume, coarser_by)) {
    for (int axis = 0; axis < 3; ++axis) {
      const long n = volume.size()[axis];
      for (long i = 0; i < n; ++i)
        block_of_[axis].push_back(int((2 * i + 1) * size_[axis] / (2 * n)));
    }
  }
  const std::array<int, 3>& size() const { return size_; }

  const std::vector<float>& slice(int k) {
    const auto& full = volume_.size();
    const auto [begin, end] = std::equal_range(block_of_[2].begin(), block_of_[2].end(), k);
    const int first = int(begin - block_of_[2].begin()), last = int(end - block_of_[2].begin());
    values_.resize(std::size_t(full[0]) * full[1] * std::size_t(last - first));
    volume_.copy_box({0, 0, first}, {full[0], full[1], last}, values_.data());
    if (size_ == full) return values_;
    sums_.assign(std::size_t(size_[0]) * size_[1], 0);
    counts_.assign(sums_.size(), 0);
    const float* value = values_.data();
    for (int z = first; z < last; ++z)
      for (int j = 0; j < full[1]; ++j)
        for (int i = 0; i < full[0]; ++i) {
          const std::size_t at = std::size_t(block_of_[1][j]) * size_[0] + block_of_[0][i];
          sums_[at] += *value++;
          ++counts_[at];
        }
    for (std::size_t at = 0; at < sums_.size(); ++at) sums_[at] /= counts_[at];
    return sums_;
  }

 private:
  const Volume& volume_;
  std::array<int, 3> size_;
  std::array<std::vector<int>, 3> block_of_;  // of each voxel along each axis
  std::vector<float> values_, sums_, counts_;
};

struct Storage {
  short datatype = DT_INT16;
  double slope = 1, intercept = 0;
};

/// From the values as they will be written: one pass, slice by slice.
Storage storage_of(Slices& slices, const std::array<float, 2>& range) {
  bool are_whole = range[0] >= -32768 && range[1] <= 32767;
  for (int k = 0; are_whole && k < slices.size()[2]; ++k) {
    const auto& values = slices.slice(k);
    are_whole = std::all_of(values.begin(), values.end(), is_whole);
  }
  if (are_whole) return {short(range[0] >= 0 && range[1] <= 255 ? DT_UINT8 : DT_INT16), 1, 0};
  const double span = std::max(double(range[1]) - range[0], 1e-30);
  return {DT_INT16, span / kSteps, range[0] + span / 2};
}

}  // namespace

Display display_of(const Volume& volume) {
  Display out;
  std::vector<float> values = samples_of(volume);
  const auto range = volume.range();
  out.is_ct = range[0] <= -200 && std::all_of(values.begin(), values.end(), is_whole);
  const auto quantile = [&](double share) {
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return double(*at);
  };
  out.window = {quantile(kCut), quantile(1 - kCut)};
  if (!(out.window[1] > out.window[0])) out.window = {range[0], range[1]};
  if (out.is_ct) {
    const auto n_lung = std::count_if(values.begin(), values.end(),
                                      [](float v) { return v > kLung[0] && v < kLung[1]; });
    out.window = double(n_lung) > kShareOfLung * double(values.size()) ? kThorax : kSoftTissue;
  }
  for (int axis = 0; axis < 3; ++axis)
    out.coarser_by[axis] = (volume.size()[axis] + kMostVoxels - 1) / kMostVoxels;
  for (;;) {
    const auto shown = coarser_size(volume, out.coarser_by);
    if (2.0 * shown[0] * shown[1] * shown[2] <= kMostBytes) return out;
    ++out.coarser_by[std::max_element(shown.begin(), shown.end()) - shown.begin()];
  }
}

std::string volume_file(const Volume& volume, const std::array<int, 3>& coarser_by) {
  Slices slices(volume, coarser_by);
  const Storage storage = storage_of(slices, volume.range());
  nifti_1_header header = {};
  header.sizeof_hdr = sizeof header;
  header.dim[0] = 3;
  Eigen::Affine3d affine = volume.index_to_world();
  Eigen::Vector3d block;  // in voxels
  for (int axis = 0; axis < 3; ++axis)
    block[axis] = double(volume.size()[axis]) / slices.size()[axis];
  // To the centre of the first block.
  affine.translate((block - Eigen::Vector3d::Ones()) / 2).scale(block);
  for (int axis = 0; axis < 3; ++axis) {
    header.dim[axis + 1] = short(slices.size()[axis]);
    header.pixdim[axis + 1] = float(affine.linear().col(axis).norm());
  }
  for (int axis = 4; axis < 8; ++axis) header.dim[axis] = 1;
  header.pixdim[0] = 1;
  header.datatype = storage.datatype;
  header.bitpix = storage.datatype == DT_UINT8 ? 8 : 16;
  header.vox_offset = 352;
  header.scl_slope = float(storage.slope);
  header.scl_inter = float(storage.intercept);
  header.xyzt_units = NIFTI_UNITS_MM;
  header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
  for (int column = 0; column < 4; ++column) {
    header.srow_x[column] = float(affine.matrix()(0, column));
    header.srow_y[column] = float(affine.matrix()(1, column));
    header.srow_z[column] = float(affine.matrix()(2, column));
  }
  std::memcpy(header.magic, "n+1", 4);
  Gzip gzip;
  gzip.add(&header, sizeof header);
  gzip.add("\0\0\0", 4);
  std::vector<std::uint8_t> bytes;
  std::vector<std::int16_t> words;
  for (int k = 0; k < slices.size()[2]; ++k) {
    const auto& values = slices.slice(k);
    if (storage.datatype == DT_UINT8) {
      bytes.assign(values.begin(), values.end());
      gzip.add(bytes.data(), bytes.size());
      continue;
    }
    words.clear();
    for (const float value : values)
      words.push_back(
          std::int16_t(std::lround((double(value) - storage.intercept) / storage.slope)));
    gzip.add(words.data(), words.size() * sizeof(std::int16_t));
  }
  return gzip.finish();
}

}  // namespace surfseg::studio
