// surfseg info: what a volume is and where it lies.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <memory>

#include "libsurf/volume/orientation.h"
#include "tools/common/report.h"
#include "tools/common/volume_arguments.h"
#include "tools/surfseg/commands.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;
using surf::volume::bounds_ras_mm;
using surf::volume::Orientation;
using surf::volume::orientation_of;
using surf::volume::Volume;

constexpr double kVisibleAngleDeg = 0.01;

constexpr const char* kFooter =
    "Reads NIfTI, MetaImage, NRRD, DICOM (a folder or one of its files), VTI and OpenVDB.\n"
    "World coordinates are millimetres of voxel centres: RAS as in NIfTI and Slicer's scene, LPS\n"
    "as in DICOM and ITK. The orientation code says where i, j and k run to.\n\n"
    "Examples:\n"
    "  surfseg info head.nii.gz\n"
    "  surfseg info dicom-folder --json";

struct Request {
  std::string path;
  bool is_json = false;
  VolumeArguments volume;
};

/// Zero for what prints as -0.
double unsigned_zero(double value) { return std::abs(value) < 1e-9 ? 0.0 : value; }

ordered_json array_of(const Eigen::Vector3d& v) {
  return {unsigned_zero(v[0]), unsigned_zero(v[1]), unsigned_zero(v[2])};
}

/// A box and its centre in one space.
struct Box {
  Eigen::Vector3d lower, upper, center;

  ordered_json json() const {
    return {{"min", array_of(lower)}, {"max", array_of(upper)}, {"center", array_of(center)}};
  }
};

struct Extent {
  Box ras, lps, voxels;
};

Extent extent_of(const Volume& volume) {
  const auto [lower, upper] = bounds_ras_mm(volume.index_to_world(), volume.size());
  const Eigen::Vector3d last(volume.size()[0] - 1, volume.size()[1] - 1, volume.size()[2] - 1);
  const Eigen::Vector3d center = volume.index_to_world() * Eigen::Vector3d(0.5 * last);
  const auto lps = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return Eigen::Vector3d(-a[0], -a[1], b[2]);
  };
  return {{lower, upper, center},
          {lps(upper, lower), lps(lower, upper), lps(center, center)},
          {Eigen::Vector3d::Zero(), last, 0.5 * last}};
}

ordered_json json_of(const Volume& volume) {
  const surf::volume::Source& source = volume.source();
  const Orientation orientation = orientation_of(volume.index_to_world());
  const Extent extent = extent_of(volume);
  ordered_json document = {{"path", source.path},
                           {"format", source.format},
                           {"type", source.scalar_type},
                           {"size", volume.size()},
                           {"frames", source.n_frames},
                           {"frame", source.frame},
                           {"spacing_mm", array_of(volume.spacing())},
                           {"orientation", orientation.code},
                           {"oblique_deg", orientation.oblique_deg},
                           {"shear_deg", orientation.shear_deg},
                           {"determinant", volume.index_to_world().linear().determinant()},
                           {"orientation_source", source.orientation_source}};
  for (int row = 0; row < 4; ++row) {
    const Eigen::Vector4d values =
        volume.index_to_world().matrix().row(row).unaryExpr(&unsigned_zero);
    document["index_to_ras_mm"].push_back({values[0], values[1], values[2], values[3]});
  }
  document["ras_mm"] = extent.ras.json();
  document["lps_mm"] = extent.lps.json();
  document["voxels"] = extent.voxels.json();
  document["intensity"] = {{"min", volume.range()[0]}, {"max", volume.range()[1]}};
  document["notes"] = source.notes;
  return document;
}

std::string describe(const Orientation& orientation) {
  std::string text = orientation.code;
  if (orientation.oblique_deg > kVisibleAngleDeg)
    text += fmt::format(", oblique {:.4g} deg", orientation.oblique_deg);
  if (orientation.shear_deg > kVisibleAngleDeg)
    text += fmt::format(", sheared {:.4g} deg", orientation.shear_deg);
  return text + (orientation.is_mirrored ? ", det < 0 (mirrored)" : ", det > 0");
}

std::string text_of(const Volume& volume) {
  const surf::volume::Source& source = volume.source();
  const auto& size = volume.size();
  const Eigen::Vector3d spacing = volume.spacing();
  KeyValues lines(12);
  lines.add("path", source.path);
  lines.add("format", source.format);
  lines.add("type", source.scalar_type);
  lines.add("size", fmt::format("{} x {} x {}", size[0], size[1], size[2]));
  if (source.n_frames > 1)
    lines.add("frames", fmt::format("{}, read frame {}", source.n_frames, source.frame));
  lines.add("spacing",
            fmt::format("{:.6g} x {:.6g} x {:.6g} mm", spacing[0], spacing[1], spacing[2]));
  lines.add("orientation",
            fmt::format("{} (from {})", describe(orientation_of(volume.index_to_world())),
                        source.orientation_source));
  const Eigen::Matrix4d matrix = volume.index_to_world().matrix().unaryExpr(&unsigned_zero);
  for (int row = 0; row < 4; ++row)
    lines.add(row == 0 ? "affine" : "",
              fmt::format("{:12.6f} {:12.6f} {:12.6f} {:12.6f}", matrix(row, 0), matrix(row, 1),
                          matrix(row, 2), matrix(row, 3)));
  const Extent extent = extent_of(volume);
  const auto range = [&](const char* key, const Box& box) {
    const Eigen::Vector3d a = box.lower.unaryExpr(&unsigned_zero),
                          b = box.upper.unaryExpr(&unsigned_zero),
                          c = box.center.unaryExpr(&unsigned_zero);
    lines.add(key,
              fmt::format("{:.3f}..{:.3f}, {:.3f}..{:.3f}, {:.3f}..{:.3f}; centre {:.3f}, {:.3f}, "
                          "{:.3f}",
                          a[0], b[0], a[1], b[1], a[2], b[2], c[0], c[1], c[2]));
  };
  range("RAS mm", extent.ras);
  range("LPS mm", extent.lps);
  range("voxels", extent.voxels);
  lines.add("intensity", fmt::format("{:.6g}..{:.6g}", volume.range()[0], volume.range()[1]));
  for (const std::string& note : source.notes) lines.add("note", note);
  return lines.text();
}

void run(const Request& request) {
  const Volume volume = request.volume.read(request.path);
  const std::string text =
      request.is_json
          ? json_of(volume).dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n"
          : text_of(volume);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

void add_info_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command = app.add_subcommand("info", "Say what a volume is and where it lies.");
  command->add_option("FILE", request->path, "Volume: a file, or a folder of DICOM slices")
      ->required();
  command->add_flag("--json", request->is_json, "Print JSON");
  request->volume.add_to(*command);
  command->footer(kFooter);
  command->callback([request] { run(*request); });
}

}  // namespace surfseg
