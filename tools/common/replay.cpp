#include "tools/common/replay.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/segment/recipe.h"

namespace surfseg {
namespace {

/// "FILE: " and what is wrong with the recipe in it.
[[noreturn]] void fail(const ReplayArguments& a, const surf::InputError& error) {
  throw surf::InputError(fmt::format("{}: {}", a.path, error.what()));
}

}  // namespace

void add_replay_arguments(CLI::App& command, ReplayArguments& a) {
  command.add_option("RECIPE", a.path, "What --recipe of segment wrote");
  command.add_option("--object", a.object, "Which object to write, if the recipe has several");
  const std::string group = "Output and running";
  command.add_option("--json", a.json, "Summary")->group(group);
  command.add_option("--threads", a.threads, "Threads [all]; the result is the same")->group(group);
  command.add_flag("-q,--quiet", a.quiet, "Print errors only")->group(group);
  command.add_flag("-v,--verbose", a.verbose, "Print every step")->group(group);
}

std::string read_recipe(const ReplayArguments& a) {
  if (a.path.empty()) throw surf::UsageError("RECIPE: a recipe is missing");
  std::ifstream stream(a.path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(a.path))
    throw surf::InputError(fmt::format("{}: cannot be read", a.path));
  return {std::istreambuf_iterator<char>(stream), {}};
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
  const fs::path beside = fs::path(a.path).parent_path() / named;
  return !fs::exists(named) && fs::exists(beside) ? beside.string() : named;
}

template <int Dim>
surf::segment::Object<Dim> replayed(
    const ReplayArguments& a, const std::string& recipe,
    const std::shared_ptr<const surf::segment::Setting<Dim>>& setting,
    const surf::segment::ProgressOf<Dim>& progress) {
  surf::segment::Segmentation<Dim> segmentation(setting);
  std::stop_source stop;
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
  std::vector<std::string> names;
  for (const int id : segmentation.objects()) {
    const surf::segment::Object<Dim>& object = segmentation.object(id);
    names.push_back(object.name);
    if (object.name == a.object || (a.object.empty() && segmentation.objects().size() == 1))
      return object;
  }
  if (names.empty()) throw surf::InputError(fmt::format("{}: the recipe has no object", a.path));
  throw surf::UsageError(
      fmt::format("--object: expected one of '{}'; got '{}'", fmt::join(names, "', '"), a.object));
}

template surf::segment::Object<2> replayed<2>(
    const ReplayArguments&, const std::string&,
    const std::shared_ptr<const surf::segment::Setting<2>>&, const surf::segment::ProgressOf<2>&);
template surf::segment::Object<3> replayed<3>(
    const ReplayArguments&, const std::string&,
    const std::shared_ptr<const surf::segment::Setting<3>>&, const surf::segment::ProgressOf<3>&);

}  // namespace surfseg
