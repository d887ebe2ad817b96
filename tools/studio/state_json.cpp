#include "tools/studio/state_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "tools/studio/object_options.h"
#include "tools/studio/volume_file.h"

namespace surfseg::studio {
namespace {

using nlohmann::ordered_json;

ordered_json to_json(const Vector<3>& point) { return {point[0], point[1], point[2]}; }

std::string colour_text(const surf::segment::Colour& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]);
}

ordered_json to_json(const OpenVolume& open) {
  const auto& volume = open.volume;
  ordered_json affine = ordered_json::array();
  for (int row = 0; row < 4; ++row) {
    const Eigen::Vector4d r = volume.index_to_world().matrix().row(row);
    affine.push_back({r[0], r[1], r[2], r[3]});
  }
  const Eigen::Vector3d spacing = volume.spacing();
  const auto range = volume.range();
  const Display display = display_of(volume);
  ordered_json notes = open.notes;
  if (const int most = *std::max_element(display.coarser_by.begin(), display.coarser_by.end());
      most > 1)
    notes.push_back(
        fmt::format("the views are up to {} times coarser; the surface uses all voxels", most));
  return {{"revision", open.number},
          {"path", open.name},
          {"kept_in", open.recipe.filename().string()},
          {"size", volume.size()},
          {"spacing_mm", to_json(spacing)},
          {"index_to_world", affine},
          {"minimum", range[0]},
          {"maximum", range[1]},
          {"window", display.window},
          {"is_ct", display.is_ct},
          {"coarser_by", display.coarser_by},
          {"notes", notes}};
}

ordered_json measures_to_json(const surf::segment::Measures<3>& measures,
                              const std::optional<surf::segment::Certainty<3>>& certainty) {
  ordered_json out = {{"volume_ml", measures.content / 1000},
                      {"volume_deviation_ml", nullptr},
                      {"area_cm2", measures.measure / 100},
                      {"triangles", measures.n_elements},
                      {"vertices", measures.n_vertices},
                      {"components", measures.n_components},
                      {"passed", measures.passed},
                      {"verification", measures.verdict},
                      {"share_without_edge", nullptr},
                      {"next_click", nullptr}};
  if (!certainty) return out;
  out["volume_deviation_ml"] = certainty->content_deviation / 1000;
  out["share_without_edge"] = certainty->share_without_edge;
  if (certainty->next_click_mm) out["next_click"] = to_json(*certainty->next_click_mm);
  return out;
}

ordered_json to_json(const ObjectState& state) {
  const surf::segment::Object<3>& object = state.object;
  const auto& result = *object.result;
  ordered_json clicks = ordered_json::array();
  for (const auto& click : object.clicks)
    clicks.push_back({{"point", to_json(click.point_mm)},
                      {"side", click.side == Side::kInside ? "inside" : "outside"}});
  ordered_json candidates = ordered_json::array();
  for (std::size_t n = 0; n < result.proposals.size(); ++n)
    candidates.push_back({{"number", n + 1},
                          {"words", to_string(result.proposals[n])},
                          {"score", result.proposals[n].score},
                          {"volume_ml", result.proposals[n].enclosed / 1000},
                          {"chosen", n == result.chosen}});
  ordered_json out = {{"id", state.id},
                      {"name", object.name},
                      {"colour", colour_text(object.colour)},
                      {"clicks", clicks},
                      {"options", options_to_json(object.options)},
                      {"outcome", to_string(result.outcome)},
                      {"message", result.message},
                      {"outdated", state.is_outdated},
                      {"has_surface", state.measures != nullptr},
                      {"surface", state.surface},
                      {"measures", nullptr},
                      {"verdict", nullptr},
                      {"candidates", candidates},
                      {"notes", result.notes},
                      {"can_undo", state.can_undo},
                      {"can_redo", state.can_redo},
                      {"undo_words", state.undo_words},
                      {"redo_words", state.redo_words}};
  if (state.measures) out["measures"] = measures_to_json(*state.measures, result.certainty);
  if (result.verdict && state.measures && !state.is_outdated)
    out["verdict"] = {{"trust", to_string(result.verdict->trust)},
                      {"words", result.verdict->words()},
                      {"place", to_json(result.verdict->place_mm)}};
  return out;
}

std::string words_of(const FolderEntry& entry) {
  return entry.bytes == 0 ? "" : fmt::format("{:.3g} MB", double(entry.bytes) / 1e6);
}

ordered_json to_json(const std::vector<surf::volume::DicomSeries>& series) {
  ordered_json out = ordered_json::array();
  for (const auto& one : series)
    out.push_back(
        {{"id", one.uid},
         {"words", fmt::format("{} {}, {} files", one.modality, one.description, one.n_files)}});
  return out;
}

template <class T>
void append(std::string& out, const T* values, std::size_t n) {
  out.append(reinterpret_cast<const char*>(values), n * sizeof(T));
}

void append(std::string& out, const Eigen::VectorXd& values) {
  const Eigen::VectorXf single = values.cast<float>();
  append(out, single.data(), std::size_t(single.size()));
}

}  // namespace

ordered_json to_json(const Job& job) {
  return {{"id", job.number}, {"object", job.object},   {"what", job.what},  {"stage", job.stage},
          {"step", job.step}, {"seconds", job.seconds}, {"frame", job.frame}};
}

ordered_json to_json(const State& state, const std::filesystem::path& folder,
                     const std::string& version) {
  ordered_json files = ordered_json::array();
  for (const FolderEntry& entry : entries_of(folder)) {
    files.push_back({{"path", entry.name}, {"kind", entry.kind}, {"words", words_of(entry)}});
    if (const auto several = state.series_of.find(entry.name); several != state.series_of.end())
      files.back()["series"] = to_json(several->second);
  }
  ordered_json objects = ordered_json::array();
  for (const ObjectState& object : state.objects) objects.push_back(to_json(object));
  return {{"revision", state.revision},
          {"program", {{"name", "surfseg"}, {"version", version}}},
          {"folder", folder.filename().string()},
          {"files", files},
          {"volume", state.volume ? to_json(*state.volume) : ordered_json()},
          {"job", state.job ? to_json(*state.job) : ordered_json()},
          {"objects", objects},
          {"removed", state.removed.empty() ? ordered_json() : ordered_json(state.removed)},
          {"error", state.error.empty()
                        ? ordered_json()
                        : ordered_json{{"id", state.error_number}, {"text", state.error}}}};
}

std::string surface_bytes(const surf::Triangles& surface, int frame,
                          const surf::segment::Certainty<3>* certainty) {
  const std::uint32_t head[] = {std::uint32_t(surface.points.rows()),
                                std::uint32_t(surface.elements.rows()), certainty ? 2u : 0u,
                                std::uint32_t(frame)};
  std::string out;
  append(out, head, 4);
  const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> points =
      surface.points.cast<float>();
  append(out, points.data(), std::size_t(points.size()));
  append(out, surface.elements.data(), std::size_t(surface.elements.size()));
  if (certainty) {
    append(out, certainty->deviation_mm);
    append(out, certainty->edge_strength);
  }
  return out;
}

}  // namespace surfseg::studio
