// surfseg evaluate: a surface against a reference mesh or label map, and its own quality.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <memory>
#include <optional>

#include "libsurf/base/error.h"
#include "tools/common/outputs.h"
#include "tools/common/reference.h"
#include "tools/common/report.h"
#include "tools/common/surface_scores.h"
#include "tools/common/volume_arguments.h"
#include "tools/surfseg/commands.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFooter =
    "SURFACE and a reference MESH are .stl, .obj, .ply or .vtp, in the space their header states\n"
    "(SPACE=RAS or LPS; else --unstated-space). Any other reference is read as a LABELMAP, a "
    "volume of\n"
    "labels; without --label all its voxels that are not 0 are the object.\n\n"
    "Dice and Jaccard against a label map count voxel centres, against a mesh the\n"
    "points of a grid with 256 points along each side of both. Distances are\n"
    "between surfaces, both ways: mean and RMS over both areas, 95 % and maximum as the larger of\n"
    "both ways. A label map's surface runs halfway between its voxels, stairs and all:\n"
    "even a perfect surface is about 0.17 voxels from it on average. Where a surface is open "
    "there\n"
    "is no Dice and no volume (null in JSON).\n\n"
    "Examples:\n"
    "  surfseg evaluate liver.stl --reference liver-by-hand.nii.gz --label 5\n"
    "  surfseg evaluate ball.ply --reference ball-exact.vtp --json scores.json";

struct Request {
  std::string surface, reference, json;
  std::optional<int> label;
  std::string unstated_space = "lps";
  VolumeArguments which;
};

ordered_json evaluate(const Request& request) {
  const surf::Triangles surface = read_compared(request.surface, request.unstated_space);
  ordered_json scores = {{"surface", request.surface},
                         {"reference", request.reference},
                         {"label", request.label ? ordered_json(*request.label) : ordered_json()}};
  scores.update(surface_scores(
      surface,
      read_reference(request.reference, request.label, request.which, request.unstated_space),
      request.label));
  return scores;
}

std::string text_of(const ordered_json& scores) {
  KeyValues lines(18);
  const auto number = [](const ordered_json& value, const char* format) {
    return fmt::format(fmt::runtime(format), value.get<double>());
  };
  const ordered_json &distance = scores["distance"], &quality = scores["quality"];
  if (scores["volume_mm3"].is_null()) {
    lines.add("overlap", "none: a surface is open or not oriented and encloses no volume");
  } else {
    if (scores["dice"].is_null()) {
      lines.add("overlap", "unknown: no point of the grid over both lies in either of them");
    } else {
      lines.add("Dice", number(scores["dice"], "{:.4f}"));
      lines.add("Jaccard", number(scores["jaccard"], "{:.4f}"));
    }
    lines.add("volume", number(scores["volume_mm3"], "{:.1f} mm3") +
                            number(scores["volume_difference_percent"], " ({:+.2f} %)"));
    lines.add("reference volume", number(scores["reference_volume_mm3"], "{:.1f} mm3"));
  }
  lines.add("mean distance", number(distance["mean_mm"], "{:.4f} mm"));
  lines.add("RMS distance", number(distance["rms_mm"], "{:.4f} mm"));
  lines.add("95 % distance", number(distance["p95_mm"], "{:.4f} mm"));
  lines.add("maximum distance", number(distance["max_mm"], "{:.4f} mm"));
  lines.add("verification", quality["message"].get<std::string>());
  lines.add("area", number(quality["area_mm2"], "{:.1f} mm2"));
  lines.add("angles", number(quality["min_angle_deg"], "{:.1f}") +
                          number(quality["max_angle_deg"], "..{:.1f} deg, ") +
                          fmt::format("{:.1f} % of the triangles with all angles >= 25 deg",
                                      100 * quality["share_above_25_deg"].get<double>()));
  lines.add("edges", number(quality["min_edge_mm"], "{:.4g}") +
                         number(quality["max_edge_mm"], "..{:.4g} mm, mean ") +
                         number(quality["mean_edge_mm"], "{:.4g} mm"));
  return lines.text();
}

void run(const Request& request) {
  check_outputs({{"--json", request.json}},
                {{"the surface", request.surface}, {"--reference", request.reference}});
  const ordered_json scores = evaluate(request);
  if (!request.json.empty()) write_json(request.json, scores);
  const std::string text = text_of(scores);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace

void add_evaluate_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare a surface with a reference mesh or label map.");
  command->add_option("SURFACE", request->surface, "Surface: .stl, .obj, .ply or .vtp")->required();
  command->add_option("--reference", request->reference, "Mesh or label map to compare with")
      ->required();
  command->add_option("--label", request->label, "Label of the object in the label map");
  request->which.add_to(*command);
  command
      ->add_option("--unstated-space", request->unstated_space,
                   "Space of surface files that state none: ras or lps")
      ->check(CLI::IsMember({"ras", "lps"}))
      ->capture_default_str();
  command->add_option("--json", request->json, "Write the scores to this file");
  command->footer(kFooter);
  command->callback([request] { run(*request); });
}

}  // namespace surfseg
