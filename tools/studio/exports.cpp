#include "tools/studio/exports.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/base/file.h"
#include "libsurf/io/picture.h"
#include "libsurf/io/slices.h"
#include "libsurf/mesh/form.h"
#include "libsurf/mesh/region_intensities.h"
#include "libsurf/segment/finish_objects.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/exit_codes.h"
#include "tools/common/field_names.h"
#include "tools/common/outputs.h"
#include "tools/common/replay.h"
#include "tools/report/report.h"
#include "tools/studio/folder.h"

namespace surfseg::studio {
namespace {

using nlohmann::ordered_json;
using Finished = std::vector<surf::segment::FinishedObject<3>>;

Finished finished(const State& state, const std::string& extension) {
  std::vector<const surf::segment::Result<3>*> results;
  std::vector<std::string> names;
  for (const ObjectState& object : state.objects) {
    results.push_back(object.object.result.get());
    names.push_back(object.object.name);
  }
  return surf::segment::finish_objects<3>(*state.volume->setting, results, extension, names);
}

std::size_t index_of(const State& state, int id) {
  for (std::size_t n = 0; n < state.objects.size(); ++n)
    if (state.objects[n].id == id) return n;
  throw surf::UsageError(fmt::format("there is no object {}", id));
}

const surf::segment::Finished<3>& sound(const surf::segment::FinishedObject<3>& object) {
  if (!object.finished) std::rethrow_exception(object.failure);
  return *object.finished;
}

void write_surface(const State& state, const Export& wanted, const std::string& path) {
  surf::volume::check_dicom_output(path, state.volume->volume);
  const auto all = finished(state, surf::extension(path));
  const std::size_t n = index_of(state, wanted.object);
  surf::io::WriteOptions options{file_space(wanted.space)};
  options.colour = state.objects[n].object.colour;
  options.name = state.objects[n].object.name;
  options.dicom = state.volume->volume.dicom();
  surf::segment::write(path, sound(all[n]), std::move(options));
}

/// Each object has its number, one alone has 1.
void write_labels(const State& state, const Export& wanted, const std::string& path) {
  Finished all = finished(state, ".stl");
  const surf::volume::Volume& volume = state.volume->volume;
  std::vector<std::uint8_t> labels = surf::segment::label_map<3>(
      *state.volume->setting, {volume.size(), volume.index_to_world(), volume.world_to_index()},
      all);
  if (wanted.object != 0) {
    const std::size_t n = index_of(state, wanted.object);
    sound(all[n]);
    for (std::uint8_t& label : labels) label = label == n + 1 ? 1 : 0;
  }
  std::vector<surf::volume::LabelName> names;
  for (std::size_t n = 0; n < state.objects.size(); ++n) {
    const auto& [id, object] = std::tie(state.objects[n].id, state.objects[n].object);
    if (wanted.object == 0)
      names.push_back({std::uint8_t(n + 1), object.name, object.colour});
    else if (id == wanted.object)
      names.push_back({1, object.name, object.colour});
  }
  surf::volume::write_label_map(path, volume, labels, names);
}

std::string quoted(std::string text) {
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2)
    text.insert(at, 1, '"');
  return '"' + text + '"';
}

void write_measures(const State& state, const Export& wanted, const std::string& path) {
  if (wanted.object != 0) index_of(state, wanted.object);
  std::string out =
      "volume,object,outcome,verdict,volume_ml,volume_deviation_ml,area_cm2,triangles,components,"
      "centroid_ras_x_mm,centroid_ras_y_mm,centroid_ras_z_mm,share_without_edge\n";
  const auto all = finished(state, ".stl");
  for (std::size_t n = 0; n < state.objects.size(); ++n) {
    if (wanted.object != 0 && state.objects[n].id != wanted.object) continue;
    const auto& object = state.objects[n].object;
    out += fmt::format("{},{},{},{}", quoted(state.volume->name), quoted(object.name),
                       quoted(to_string(object.result->outcome)),
                       object.result->verdict ? to_string(object.result->verdict->trust) : "");
    if (!all[n].finished) {
      out += ",,,,,,,,,\n";
      continue;
    }
    const auto& measures = all[n].finished->measures;
    const auto& certainty = all[n].finished->certainty;
    out += fmt::format(",{:.9g},{},{:.9g},{},{},{:.6f},{:.6f},{:.6f},{}\n", measures.content / 1000,
                       certainty ? fmt::format("{:.3g}", certainty->content_deviation / 1000) : "",
                       measures.measure / 100, measures.n_elements, measures.components.size(),
                       measures.centroid_mm[0], measures.centroid_mm[1], measures.centroid_mm[2],
                       certainty ? fmt::format("{:.4g}", certainty->share_without_edge) : "");
  }
  surf::write_bytes(path, out);
}

void write_picture(const State& state, const Export& wanted, const std::string& path) {
  const ObjectState& object =
      state.objects.at(wanted.object == 0 ? 0 : index_of(state, wanted.object));
  if (!object.measures) throw surf::NoObject("the object has no surface to draw");
  surf::io::SliceOptions options;
  for (const auto& click : object.object.clicks)
    options.marks.push_back({click.point_mm, click.side == Side::kInside});
  surf::io::write_png(
      path, surf::io::draw_slices(object.object.result->shape, state.volume->volume, options));
}

/// As one word of a shell.
std::string shell_word(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

surfseg::ReportedObject<3> reported(const State& state, const ObjectState& object,
                                    const surf::segment::FinishedObject<3>& finished) {
  const auto* shape = finished.finished ? &*finished.finished : nullptr;
  ordered_json entry =
      ordered_json::parse(surf::segment::summary_json<3>(*object.object.result, shape));
  if (shape) {
    entry["form"] = report::form_json(surf::mesh::form(shape->shape));
    entry["intensities"] = report::intensities_json(
        surf::mesh::region_intensities(shape->shape, state.volume->volume));
  }
  if (finished.failure) {
    try {
      std::rethrow_exception(finished.failure);
    } catch (const surf::Error& error) {
      entry["not_written"] = with_option_names(error.what(), "surfseg");
    }
  }
  for (const surf::segment::Wall& wall : finished.walls)
    entry["walls"].push_back({{"with", state.objects[wall.other].object.name},
                              {"removed_mm3", wall.removed},
                              {"area_mm2", wall.measure}});
  return {&object.object, shape, entry};
}

/// As `surfseg replay` ends for these objects.
int replay_exit_code(const std::vector<surfseg::ReportedObject<3>>& objects,
                     const std::vector<std::exception_ptr>& failures) {
  const auto code_of = [&](std::size_t n) {
    try {
      if (failures[n]) std::rethrow_exception(failures[n]);
    } catch (const surf::InvalidMesh&) {
      return int(kInvalidResult);
    } catch (const std::exception&) {
      return int(kNoObject);
    }
    return surf::segment::exit_code(objects[n].object->result->outcome);
  };
  if (objects.size() == 1) return code_of(0);
  bool is_at_limit = false;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (failures[n]) return kBatchFailed;
    is_at_limit |= code_of(n) == kStoppedAtLimit;
  }
  return is_at_limit ? kStoppedAtLimit : kDone;
}

/// The page that `surfseg replay --report` makes.
void write_report(const State& state, const Export& wanted, const std::string& path) {
  const auto all = finished(state, ".stl");
  std::vector<surfseg::ReportedObject<3>> objects;
  std::vector<std::exception_ptr> failures;
  for (std::size_t n = 0; n < state.objects.size(); ++n) {
    const ObjectState& object = state.objects[n];
    if (wanted.object != 0 && object.id != wanted.object) continue;
    objects.push_back(reported(state, object, all[n]));
    failures.push_back(all[n].failure);
  }
  const std::string command =
      fmt::format("{} --report {}", replay_command(state, wanted.object), shell_word(wanted.name));
  surf::write_bytes(
      path, report::page({command, replay_exit_code(objects, failures), state.volume->volume,
                          state.volume->setting->content_hash(), objects}));
}

std::string default_name(const State& state, const Export& wanted) {
  const bool is_of_all = wanted.object == 0 || wanted.what == "recipe";
  std::string stem = is_of_all ? state.volume->name.substr(0, state.volume->name.find('.'))
                               : state.objects[index_of(state, wanted.object)].object.name;
  std::replace_if(
      stem.begin(), stem.end(),
      [](unsigned char c) { return !(std::isalnum(c) || c == '-' || c == '_' || c >= 128); }, '-');
  const std::string ending = !wanted.format.empty()      ? wanted.format
                             : wanted.what == "surface"  ? "stl"
                             : wanted.what == "labels"   ? "nii.gz"
                             : wanted.what == "measures" ? "csv"
                             : wanted.what == "picture"  ? "png"
                             : wanted.what == "report"   ? "html"
                                                         : "json";
  return stem + (wanted.what == "labels" ? "-labels." : ".") + ending;
}

/// The name ends as what it holds does.
void check_ending(const Export& wanted, const std::string& name) {
  const auto expect = [&](const std::vector<std::string>& endings) {
    const std::string extension = surf::extension(name);
    for (const std::string& ending : endings)
      if (extension == "." + ending) return;
    throw surf::UsageError(
        fmt::format("'{}': expected a name that ends in .{}", name, fmt::join(endings, ", .")));
  };
  const auto expect_one = [&](bool is_one, const std::string& all) {
    if (!is_one)
      throw surf::UsageError(fmt::format("'{}': expected a name that ends in {}", name, all));
  };
  if (wanted.what == "surface")
    expect_one(surf::io::is_writable_surface(name), surf::io::writable_surfaces());
  else if (wanted.what == "labels")
    expect_one(surf::volume::is_writable_label_map(name), surf::volume::writable_label_maps());
  else if (wanted.what == "measures")
    expect({"csv"});
  else if (wanted.what == "picture")
    expect({"png"});
  else if (wanted.what == "report")
    expect({"html"});
  else if (wanted.what == "recipe")
    expect({"json"});
  else
    throw surf::UsageError(fmt::format("there is no export of '{}'", wanted.what));
}

/// What is written together with a surface, such as its colours, is a file of its own.
void check_beside(const std::filesystem::path& folder, const std::string& path,
                  bool may_overwrite) {
  const std::string beside = std::filesystem::path(surf::io::file_beside(path)).filename().string();
  if (beside.empty()) return;
  if (std::filesystem::exists(output_path(folder, beside)) && !may_overwrite)
    throw FileExists(
        fmt::format("'{}', which is written too, is there already: overwrite it?", beside));
}

/// Objects before the one that is wanted take their part of it; those after it nothing.
/// @param is_busy  something is computed, so that waiting helps
void check_made(const State& state, const Export& wanted, bool is_busy) {
  if (wanted.what == "recipe") return;
  const char* why = is_busy ? "is still being made again: wait until it is there"
                            : "has no surface yet, since its making was stopped: G makes it";
  const bool is_alone = wanted.what == "picture";  // of the first where none is named
  for (const ObjectState& object : state.objects) {
    const bool is_it = object.id == wanted.object || (is_alone && wanted.object == 0);
    if ((is_it || !is_alone) && !object.object.is_made())
      throw surf::UsageError(fmt::format("'{}' {}", object.object.name, why));
    if (is_it) return;
  }
}

/// With what `surfseg replay` says of objects that do not heed what was done last.
State as_replayed(State state) {
  for (ObjectState& object : state.objects)
    if (object.is_outdated) object.object.result = outdated<3>(*object.object.result);
  return state;
}

}  // namespace

Exported export_file(const Dialogue& dialogue, const Export& wanted) {
  const bool is_busy = dialogue.job().has_value();  // before the state: what it makes is in that
  const State state = as_replayed(*dialogue.state());
  if (!state.volume) throw surf::UsageError("no volume is open");
  if (wanted.space != "lps" && wanted.space != "ras")
    throw surf::UsageError(fmt::format("space: expected lps or ras; got '{}'", wanted.space));
  const std::string name = wanted.name.empty() ? default_name(state, wanted) : wanted.name;
  check_ending(wanted, name);
  const std::filesystem::path path = output_path(dialogue.folder(), name);
  if (std::filesystem::exists(path)) {
    if (!wanted.may_overwrite)
      throw FileExists(fmt::format("'{}' is there already: overwrite it?", name));
    if (is_read_with(state.volume->volume.source().path, path.string()))
      throw surf::UsageError(fmt::format("'{}' is the volume that is open, or a part of it", name));
  }
  check_made(state, wanted, is_busy);
  const std::string to = path.string();
  if (wanted.what == "surface") check_beside(dialogue.folder(), to, wanted.may_overwrite);
  if (wanted.what == "surface")
    write_surface(state, wanted, to);
  else if (wanted.what == "labels")
    write_labels(state, wanted, to);
  else if (wanted.what == "measures")
    write_measures(state, wanted, to);
  else if (wanted.what == "picture")
    write_picture(state, wanted, to);
  else if (wanted.what == "report")
    write_report(state, wanted, to);
  else
    surf::write_bytes(to, dialogue.recipe());
  return {name, std::filesystem::file_size(path)};
}

std::string replay_command(const State& state, int id) {
  if (!state.volume) throw surf::UsageError("no volume is open");
  std::string out = "surfseg replay " + shell_word(state.volume->recipe.string());
  if (state.volume->series_uid) out += " --series-uid " + shell_word(*state.volume->series_uid);
  if (id == 0) return out + (state.objects.size() > 1 ? " -o '{object}.stl'" : " -o object.stl");
  std::string name = state.objects[index_of(state, id)].object.name;
  out += " --object " + shell_word(name);
  std::replace(name.begin(), name.end(), '/', '-');
  return out + " -o " + shell_word(name + ".stl");
}

}  // namespace surfseg::studio
