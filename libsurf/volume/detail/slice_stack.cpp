#include "libsurf/volume/detail/slice_stack.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/base/products.h"

namespace surf::volume {
namespace {

constexpr double kSameDirection = 1e-3;  // sine; DICOM's decimal strings keep 1e-5 or so
constexpr double kSameSpacing = 1e-3;    // relative
constexpr double kUnevenStep = 0.05;     // of the median step; rounding stays below 0.02
constexpr double kOffLine = 0.1;         // of the smallest spacing
constexpr double kSamePlace_mm = 1e-3;

std::string name(const DicomSlice& slice) {
  const std::string file = std::filesystem::path(slice.file).filename().string();
  return slice.frame == 0 ? file : fmt::format("{} frame {}", file, slice.frame);
}

void check_alike(const DicomSlice& a, const DicomSlice& b, const std::string& path) {
  const char* what = nullptr;
  if (a.rows != b.rows || a.columns != b.columns)
    what = "sizes";
  else if ((a.along_row_lps - b.along_row_lps).norm() > kSameDirection ||
           (a.along_column_lps - b.along_column_lps).norm() > kSameDirection)
    what = "orientations";
  else if (std::abs(a.pixel_width_mm - b.pixel_width_mm) > kSameSpacing * a.pixel_width_mm ||
           std::abs(a.pixel_height_mm - b.pixel_height_mm) > kSameSpacing * a.pixel_height_mm)
    what = "pixel spacings";
  if (what)
    throw InputError(
        fmt::format("{}: slices {} and {} of one series differ in their {}; remove what is not of "
                    "the volume (a localizer?)",
                    path, name(a), name(b), what));
}

Eigen::Vector3d normal_of(const DicomSlice& slice, const std::string& path) {
  const Eigen::Vector3d normal = slice.along_row_lps.cross(slice.along_column_lps);
  const bool is_orthonormal = std::abs(slice.along_row_lps.norm() - 1) < kSameDirection &&
                              std::abs(slice.along_column_lps.norm() - 1) < kSameDirection &&
                              std::abs(normal.norm() - 1) < kSameDirection;
  if (!is_orthonormal)
    throw InputError(fmt::format(
        "{}: ImageOrientationPatient of {} is not two orthogonal unit vectors; mend the header",
        path, name(slice)));
  return normal.normalized();
}

void check_steps(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& normal,
                 const std::string& path) {
  std::vector<double> steps;
  for (std::size_t n = 1; n < slices.size(); ++n) {
    const double step = normal.dot(slices[n].position_lps_mm - slices[n - 1].position_lps_mm);
    if (step < kSamePlace_mm)
      throw InputError(fmt::format(
          "{}: {} and {} lie at the same position, {:.6g} mm along the normal; keep one of them",
          path, name(slices[n - 1]), name(slices[n]), normal.dot(slices[n].position_lps_mm)));
    steps.push_back(step);
  }
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  const double median = sorted[sorted.size() / 2];
  for (std::size_t n = 0; n < steps.size(); ++n) {
    if (std::abs(steps[n] - median) <= kUnevenStep * median) continue;
    const double missing = steps[n] / median - 1;
    const bool is_whole = missing > 0.5 && std::abs(missing - std::round(missing)) < 0.1;
    throw InputError(fmt::format(
        "{}: uneven slices: {:.6g} mm between {} and {}, at {:.6g} mm along the normal, elsewhere "
        "{:.6g} mm; {}",
        path, steps[n], name(slices[n]), name(slices[n + 1]), normal.dot(slices[n].position_lps_mm),
        median,
        is_whole ? fmt::format("{:.0f} slice{} missing there, add {}", missing,
                               missing > 1.5 ? "s are" : " is", missing > 1.5 ? "them" : "it")
                 : "resample the series to even slices first"));
  }
}

/// All first pixels must lie on one line, evenly.
void check_line(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& step,
                const std::string& path) {
  const double smallest =
      std::min({slices[0].pixel_width_mm, slices[0].pixel_height_mm, step.norm()});
  for (std::size_t n = 0; n < slices.size(); ++n) {
    const Eigen::Vector3d expected = slices[0].position_lps_mm + static_cast<double>(n) * step;
    const double off = (slices[n].position_lps_mm - expected).norm();
    if (off > kOffLine * smallest)
      throw InputError(fmt::format(
          "{}: uneven slices: {} lies {:.3g} mm off the line of the others; resample the series "
          "to even slices first",
          path, name(slices[n]), off));
  }
}

void check_headers(const std::vector<DicomSlice>& slices, const std::string& path) {
  for (const DicomSlice& slice : slices) {
    check_alike(slices[0], slice, path);
    if (!(slice.pixel_width_mm > 0 && slice.pixel_height_mm > 0))
      throw InputError(fmt::format("{}: zero PixelSpacing in {}", path, name(slice)));
  }
}

}  // namespace

SliceStack stack_slices(std::vector<DicomSlice> slices, const std::string& path) {
  if (slices.size() < 2)
    throw InputError(fmt::format(
        "{}: a single slice; a volume needs at least 2, give the folder of the series", path));
  check_headers(slices, path);
  const Eigen::Vector3d normal = normal_of(slices[0], path);
  std::stable_sort(slices.begin(), slices.end(), [&](const DicomSlice& a, const DicomSlice& b) {
    return normal.dot(a.position_lps_mm) < normal.dot(b.position_lps_mm);
  });
  check_steps(slices, normal, path);
  const Eigen::Vector3d step =
      (slices.back().position_lps_mm - slices[0].position_lps_mm) / double(slices.size() - 1);
  check_line(slices, step, path);

  SliceStack stack;
  stack.size = {slices[0].columns, slices[0].rows, static_cast<int>(slices.size())};
  stack.tilt_deg = angle_between(normal, step) * 180 / std::numbers::pi;
  Eigen::Matrix4d lps = Eigen::Matrix4d::Identity();
  lps.col(0).head<3>() = slices[0].along_row_lps * slices[0].pixel_width_mm;
  lps.col(1).head<3>() = slices[0].along_column_lps * slices[0].pixel_height_mm;
  lps.col(2).head<3>() = step;
  lps.col(3).head<3>() = slices[0].position_lps_mm;
  stack.index_to_world = Eigen::Vector4d(-1, -1, 1, 1).asDiagonal() * lps;
  stack.slices = std::move(slices);
  return stack;
}

}  // namespace surf::volume
