#include "tools/batch/derivatives.h"

#include <fmt/format.h>

#include <filesystem>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "tools/common/report.h"

namespace surfseg::batch {
namespace {

/// The data set's kind; the version is that of the rules for names that are followed.
nlohmann::ordered_json description() {
  return {{"Name", "surfseg: surfaces and label maps from clicks"},
          {"BIDSVersion", "1.8.0"},
          {"DatasetType", "derivative"},
          {"GeneratedBy", {{{"Name", "surfseg"}, {"Version", SURFSEG_VERSION}}}}};
}

constexpr const char* kBeyondBids = "*.stl\n*_recipe.json\n*_surfseg.json\ngroup.*\n**/figures/\n";

/// A folder that another program made, or the scans' own, keeps what describes it.
void check_is_ours(const std::string& description) {
  if (!std::filesystem::exists(description)) return;
  bool is_ours = false;
  try {
    const nlohmann::ordered_json found = read_json(description);
    for (const auto& program : found.at("GeneratedBy")) is_ours |= program.at("Name") == "surfseg";
  } catch (const nlohmann::ordered_json::exception&) {  // it says nothing of the kind
  } catch (const surf::InputError&) {                   // it is broken
  }
  if (!is_ours)
    throw surf::OutputError(
        fmt::format("-o: {} is there and not of surfseg: give a folder of its own", description));
}

}  // namespace

CaseFiles::CaseFiles(const std::string& name, bool has_objects) {
  const std::string folder = case_folder(name), stem = folder + "/anat/" + folder,
                    figure = folder + "/figures/" + folder + "_desc-surfseg_";
  surface = stem + (has_objects ? "_label-{object}" : "") + "_desc-surfseg_surface.stl";
  const std::string map = stem + "_desc-surfseg_" + (has_objects ? "dseg" : "mask");
  labels = map + ".nii.gz";
  sidecar = map + ".json";
  if (has_objects) label_names = map + ".tsv";
  recipe = stem + "_desc-surfseg_recipe.json";
  picture = figure + "slices.png";
  thumbnail = figure + "thumbnail.png";
  report = figure + "report.html";
}

std::string case_folder(const std::string& name) { return "sub-" + name; }

std::string summary_file(const std::string& name) {
  const std::string folder = case_folder(name);
  return folder + "/anat/" + folder + "_desc-surfseg_surfseg.json";
}

void prepare_derivatives(const std::string& folder) {
  std::error_code status;
  std::filesystem::create_directories(folder, status);
  if (status)
    throw surf::OutputError(fmt::format("-o: {}: cannot be made: {}", folder, status.message()));
  check_is_ours(folder + "/dataset_description.json");
  write_json(folder + "/dataset_description.json", description());
  surf::write_bytes(folder + "/.bidsignore", kBeyondBids);
}

}  // namespace surfseg::batch
