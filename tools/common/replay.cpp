#include "tools/common/replay.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stop_token>
#include <system_error>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/volume/read_volume.h"
#include "tools/common/option_group.h"
#include "tools/common/signals.h"

namespace surfseg {
namespace {

constexpr const char* kOutdated =
    "what was done last is not heeded: the recipe ends before the evolution that would, as where a "
    "dialogue was cut off; add {\"do\": \"evolve\"} to its history";

/// "FILE: " and what is wrong with the recipe in it.
[[noreturn]] void fail(const ReplayArguments& a, const surf::InputError& error) {
  throw surf::InputError(fmt::format("{}: {}", a.path, error.what()));
}

/// A frame, slice, page or pixel size that was chosen is not in the recipe.
[[noreturn]] void fail(const ReplayArguments& a, const surf::segment::OtherImageError& error,
                       int dimension) {
  throw surf::InputError(fmt::format(
      "{}: {}; {} of segment, if there was one, is given to replay, too", a.path, error.what(),
      dimension == 3 ? "--frame-index" : "--slice, --plane, --page or --spacing"));
}

/// The names of the recipe's objects. Nothing is computed for them.
template <int Dim>
std::vector<std::string> object_names(
    const ReplayArguments& a, const std::string& recipe,
    const std::shared_ptr<const surf::segment::Setting<Dim>>& setting) {
  surf::segment::Segmentation<Dim> segmentation(setting);
  try {
    surf::segment::load<Dim>(recipe, segmentation);
  } catch (const surf::segment::OtherImageError& error) {
    fail(a, error, Dim);
  } catch (const surf::InputError& error) {
    fail(a, error);
  }
  std::vector<std::string> names;
  for (const int id : segmentation.objects()) names.push_back(segmentation.object(id).name);
  if (names.empty()) throw surf::InputError(fmt::format("{}: the recipe has no object", a.path));
  return names;
}

/// Which of them are written: the one that was asked for, the only one, or with {object} in
/// `output` all.
std::vector<bool> wanted_objects(const ReplayArguments& a, const std::vector<std::string>& names,
                                 const std::string& output) {
  if (has_object(output)) check_object_names(names);
  if (a.object.empty() && (names.size() == 1 || has_object(output)))
    return std::vector<bool>(names.size(), true);
  std::vector<bool> out;
  for (const std::string& name : names) out.push_back(name == a.object);
  if (std::find(names.begin(), names.end(), a.object) == names.end())
    throw surf::UsageError(
        fmt::format("--object: expected one of '{}', or {{object}} in -o for all "
                    "of them; got '{}'",
                    fmt::join(names, "', '"), a.object));
  return out;
}

}  // namespace

void add_replay_arguments(CLI::App& command, ReplayArguments& a) {
  command.add_option("RECIPE", a.path, "What --recipe of segment wrote");
  command.add_option("--object", a.object,
                     "Which object to write, if the recipe has several and {object} in -o does not "
                     "ask for all");
  const OptionGroup group(command, "Output and running");
  group.add("--json", a.json, "Summary");
  group.add("--threads", a.threads, "Threads [all]; the result is the same");
  group.add_flag("-q,--quiet", a.quiet, "Print errors only");
  group.add_flag("-v,--verbose", a.verbose, "Print every step");
}

std::string read_recipe(const ReplayArguments& a) {
  if (a.path.empty()) throw surf::UsageError("RECIPE: a recipe is missing");
  if (std::filesystem::is_directory(a.path))
    throw surf::InputError(fmt::format("{}: is a folder; expected a recipe", a.path));
  std::ifstream stream(a.path, std::ios::binary);
  if (!stream)
    throw surf::InputError(fmt::format("{}: cannot be read: {}", a.path, std::strerror(errno)));
  return {std::istreambuf_iterator<char>(stream), {}};
}

void check_dimension(const ReplayArguments& a, const std::string& recipe, int dimension) {
  int of_recipe = 0;
  try {
    of_recipe = surf::segment::dimension_of_recipe(recipe);
  } catch (const surf::InputError& error) {
    fail(a, error);
  }
  if (of_recipe == dimension) return;
  const bool is_of_image = of_recipe == 2;
  throw surf::InputError(fmt::format("{}: is a recipe of {}; {} replays it", a.path,
                                     is_of_image ? "an image" : "a volume",
                                     is_of_image ? "curveseg" : "surfseg"));
}

std::string image_file(const ReplayArguments& a, const std::string& recipe,
                       const std::string& chosen, const std::string& option) {
  namespace fs = std::filesystem;
  if (!chosen.empty()) return chosen;
  std::string named;
  try {
    named = surf::segment::image_of_recipe(recipe);
  } catch (const surf::InputError& error) {
    fail(a, error);
  }
  if (named.empty())
    throw surf::UsageError(fmt::format("{}: {} names no image; say which", option, a.path));
  std::error_code ignored;  // a folder that may not be entered has no such file
  if (fs::exists(named, ignored)) return named;
  const fs::path folder = fs::path(a.path).parent_path();  // moved with its scan, perhaps
  fs::path name = fs::path(named).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();  // a folder, with a slash at its end
  name = name.filename();
  if (fs::exists(folder / named, ignored)) return (folder / named).string();
  if (!name.empty() && name != ".." && name != "." && fs::exists(folder / name, ignored))
    return (folder / name).string();
  return named;
}

std::string image_series(const ReplayArguments& a, const std::string& recipe,
                         const std::string& chosen) {
  std::string named;
  try {
    named = surf::segment::series_of_recipe(recipe);
  } catch (const surf::InputError& error) {
    fail(a, error);
  }
  if (chosen.empty() || named.empty()) return named;
  std::error_code ignored;
  if (!std::filesystem::is_directory(chosen, ignored)) return "";
  // The same images may have another UID there, as where names were taken out.
  const auto there = surf::volume::dicom_series(chosen);
  const bool has_it = std::any_of(there.begin(), there.end(),
                                  [&](const auto& series) { return series.uid == named; });
  return has_it ? named : "";
}

template <int Dim>
std::vector<SegmentedObject<Dim>> replayed(
    const ReplayArguments& a, const std::string& recipe, const std::string& output,
    const std::shared_ptr<const surf::segment::Setting<Dim>>& setting,
    const std::function<void(const std::vector<std::string>&)>& check_names,
    const surf::segment::ProgressOf<Dim>& progress) {
  const std::vector<std::string> names = object_names(a, recipe, setting);
  const std::vector<bool> is_wanted = wanted_objects(a, names, output);
  std::vector<std::string> wanted;
  for (std::size_t n = 0; n < names.size(); ++n)
    if (is_wanted[n]) wanted.push_back(names[n]);
  check_names(wanted);
  surf::segment::Segmentation<Dim> segmentation(setting);
  std::stop_source stop;
  const SignalStop signal;
  const std::stop_callback forwarded(signal.token(), [&] { stop.request_stop(); });
  try {
    surf::segment::replay<Dim>(
        recipe, segmentation,
        [&](const auto& stage, const auto& record, const auto& shape) {
          const bool goes_on = progress(stage, record, shape);
          if (!goes_on) stop.request_stop();
          return goes_on;
        },
        stop.get_token());
  } catch (const surf::InputError& error) {
    fail(a, error);
  }
  std::vector<SegmentedObject<Dim>> out;
  for (const int id : segmentation.objects()) {
    out.push_back({segmentation.object(id), {}, is_wanted[out.size()]});
    if (!segmentation.is_outdated(id)) continue;
    out.back().object.result = outdated<Dim>(*out.back().object.result);
  }
  return out;
}

template <int Dim>
std::shared_ptr<const surf::segment::Result<Dim>> outdated(
    const surf::segment::Result<Dim>& result) {
  auto out = std::make_shared<surf::segment::Result<Dim>>(result);
  out->notes.push_back(kOutdated);
  out->verdict.reset();
  return out;
}

#define SURFSEG_INSTANTIATE(Dim)                                            \
  template std::shared_ptr<const surf::segment::Result<Dim>> outdated<Dim>( \
      const surf::segment::Result<Dim>&);                                   \
  template std::vector<SegmentedObject<Dim>> replayed<Dim>(                 \
      const ReplayArguments&, const std::string&, const std::string&,       \
      const std::shared_ptr<const surf::segment::Setting<Dim>>&,            \
      const std::function<void(const std::vector<std::string>&)>&,          \
      const surf::segment::ProgressOf<Dim>&);
SURFSEG_INSTANTIATE(2)
SURFSEG_INSTANTIATE(3)
#undef SURFSEG_INSTANTIATE

}  // namespace surfseg
