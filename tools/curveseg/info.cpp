// curveseg info: what an image is.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "tools/common/report.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {
namespace {

using nlohmann::ordered_json;
using surf::curve::Image;

struct Request {
  ImageArguments image;
  bool is_json = false;
};

ordered_json json_of(const Image& image) {
  const auto& source = image.source();
  const Eigen::Vector2d spacing = image.spacing();
  ordered_json out = {{"path", source.path},
                      {"format", source.format},
                      {"type", source.scalar_type},
                      {"size", image.size()},
                      {"spacing_mm", {spacing[0], spacing[1]}},
                      {"spacing_source", source.spacing_source},
                      {"intensity", {{"min", image.range()[0]}, {"max", image.range()[1]}}},
                      {"notes", source.notes}};
  if (image.plane_to_ras())
    for (int row = 0; row < 3; ++row) {
      const Eigen::Vector4d values = image.plane_to_ras()->matrix().row(row);
      out["mm_to_ras"].push_back({values[0], values[1], values[2], values[3]});
    }
  return out;
}

std::string text_of(const Image& image) {
  const auto& source = image.source();
  KeyValues lines(12);
  lines.add("path", source.path);
  lines.add("format", source.format);
  lines.add("type", source.scalar_type);
  lines.add("size", fmt::format("{} x {}", image.size()[0], image.size()[1]));
  lines.add("spacing",
            fmt::format("{:.6g} x {:.6g} mm (from {})", image.spacing()[0], image.spacing()[1],
                        source.spacing_source == "unknown" ? "nothing: pixels count as 1 mm"
                                                           : source.spacing_source));
  if (image.plane_to_ras())
    for (int row = 0; row < 3; ++row) {
      const Eigen::Vector4d v = image.plane_to_ras()->matrix().row(row);
      lines.add(row == 0 ? "mm to RAS" : "",
                fmt::format("{:12.6f} {:12.6f} {:12.6f} {:12.6f}", v[0], v[1], v[2], v[3]));
    }
  lines.add("intensity", fmt::format("{:.6g}..{:.6g}", image.range()[0], image.range()[1]));
  for (const std::string& note : source.notes) lines.add("note", note);
  return lines.text();
}

}  // namespace

void add_info_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command = app.add_subcommand("info", "Say what an image or slice is");
  add_image_arguments(*command, request->image);
  command->add_flag("--json", request->is_json, "Print JSON");
  command->footer(
      "Examples:\n"
      "  curveseg info cells.tif\n"
      "  curveseg info head.nii.gz --slice axial:80 --json");
  command->callback([request] {
    const Image image = request->image.read();
    const std::string text =
        request->is_json
            ? json_of(image).dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n"
            : text_of(image);
    std::fwrite(text.data(), 1, text.size(), stdout);
  });
}

}  // namespace surfseg::curve_program
