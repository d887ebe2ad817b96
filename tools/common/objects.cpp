#include "tools/common/objects.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/io/write_surface.h"
#include "tools/common/option_group.h"

namespace surfseg {
namespace {

using surf::UsageError;
using surf::segment::Side;

constexpr std::array kOfOneObject = {"seed", "outside", "box", "marks"};
constexpr const char* kPattern = "{object}";
constexpr std::size_t kMostObjects = 255;  // labels of a byte

using surf::segment::Click;

template <int Dim>
bool has_inside(const std::vector<Click<Dim>>& strokes) {
  return std::any_of(strokes.begin(), strokes.end(),
                     [](const Click<Dim>& stroke) { return stroke.side == Side::kInside; });
}

/// Inside ones stay before outside ones, whichever file they are of.
template <int Dim>
void add_strokes(const std::vector<Click<Dim>>& some, std::vector<Click<Dim>>& strokes) {
  strokes.insert(strokes.end(), some.begin(), some.end());
  std::stable_partition(strokes.begin(), strokes.end(),
                        [](const Click<Dim>& stroke) { return stroke.side == Side::kInside; });
}

/// @throws surf::UsageError  some of it is from a config
void check_is_typed(const CLI::App& command, const std::string& option) {
  const std::vector<CLI::Option*> typed = command.parse_order();
  const auto n_typed = std::count_if(typed.begin(), typed.end(), [&](const CLI::Option* given) {
    return given->check_lname(option);
  });
  if (command.count("--" + option) > std::size_t(n_typed))
    throw UsageError(fmt::format(
        "--{}: a config does not hold whose clicks are whose; use --recipe, and replay it",
        option));
}

}  // namespace

bool is_fit_for_a_file(const std::string& name) {
  return !name.empty() && name.front() != '.' && name.front() != '-' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return c != '/' && c != '\\' && c != '{' && c != '}' &&
                  !std::iscntrl(static_cast<unsigned char>(c));
         });
}

void check_object_names(const std::vector<std::string>& names) {
  std::set<std::string> seen;
  for (const std::string& name : names) {
    if (!is_fit_for_a_file(name))
      throw UsageError(fmt::format(
          "--object: expected a name that a file can have, such as liver; got '{}'", name));
    if (!seen.insert(name).second)
      throw UsageError(fmt::format("--object: '{}' is there twice; give another name", name));
  }
  if (names.size() > kMostObjects)
    throw UsageError(
        fmt::format("--object: {} objects; at most {} have a label", names.size(), kMostObjects));
}

void add_object_option(CLI::App& command, RunArguments& a) {
  OptionGroup(command, "Where to start")
      .add_repeatable("--object", a.objects,
                      "Begin the next of several objects, which never overlap: the --seed and "
                      "--outside after it are its own; -o then needs {object} in its name");
}

bool has_object(const std::string& pattern) { return pattern.find(kPattern) != std::string::npos; }

void check_is_of_all(const std::string& option, const std::string& path) {
  if (has_object(path))
    throw UsageError(
        fmt::format("{}: {}: one file tells of all objects; leave {{object}} out", option, path));
}

std::string object_path(const std::string& pattern, const std::string& name) {
  std::string out = pattern;
  const std::string word = kPattern;
  for (std::size_t at = out.find(word); at != std::string::npos;
       at = out.find(word, at + name.size()))
    out.replace(at, word.size(), name);
  return out;
}

std::vector<Output> object_outputs(const std::vector<Output>& patterns,
                                   const std::vector<std::string>& names) {
  std::vector<Output> out;
  const auto add = [&](const std::string& option, const std::string& path) {
    out.emplace_back(option, path);
    if (option == "-o") out.emplace_back(option, surf::io::file_beside(path));
  };
  for (const auto& [option, pattern] : patterns) {
    if (names.empty() || !has_object(pattern)) {
      add(option, pattern);
      continue;
    }
    for (const std::string& name : names) add(option, object_path(pattern, name));
  }
  return out;
}

std::vector<Output> read_files(const RunArguments& a, std::vector<Output> own) {
  for (const std::string& path : a.marks) own.emplace_back("--marks", path);
  if (a.config != a.json) own.emplace_back("--config", a.config);
  return own;
}

void check_objects(const CLI::App& command, const RunArguments& a,
                   const std::vector<Output>& each) {
  for (const auto& [option, path] :
       {Output{"--json", a.json}, {"--recipe", a.recipe}, {"--checkpoint", a.checkpoint}})
    check_is_of_all(option, path);
  if (a.objects.empty()) {
    if (a.boxes.size() > 1)
      throw UsageError(fmt::format(
          "--box: {} boxes; an object has one, the next begins with --object", a.boxes.size()));
    for (const auto& [option, path] : each)
      if (has_object(path))
        throw UsageError(fmt::format("{}: {}: there is no --object to name", option, path));
    return;
  }
  check_object_names(a.objects);
  check_is_typed(command, "object");
  for (const char* name : kOfOneObject) check_is_typed(command, name);
  std::size_t n_begun = 0, n_seeds = 0, n_boxes = 0;
  const auto check_seeds = [&] {
    if (n_begun > 0 && n_seeds == 0)
      throw UsageError(
          fmt::format("--object {}: at least one --seed inside it, or --marks, has to follow",
                      a.objects[n_begun - 1]));
  };
  for (const CLI::Option* given : command.parse_order()) {
    if (given->check_lname("object")) {
      check_seeds();
      ++n_begun;
      n_seeds = n_boxes = 0;
      continue;
    }
    const auto word = std::find_if(kOfOneObject.begin(), kOfOneObject.end(),
                                   [&](const char* name) { return given->check_lname(name); });
    if (word == kOfOneObject.end()) continue;
    n_seeds += given->check_lname("seed") || given->check_lname("marks");
    if (n_begun == 0)
      throw UsageError(
          fmt::format("--{}: comes before the first --object; say first whose it is", *word));
    if (given->check_lname("box") && ++n_boxes > 1)
      throw UsageError(fmt::format("--box: the second one of --object {}", a.objects[n_begun - 1]));
  }
  check_seeds();
  if (a.objects.size() == 1) return;
  for (const auto& [option, path] : each)
    if (!path.empty() && !has_object(path))
      throw UsageError(fmt::format(
          "{}: {}: several objects are written; put {} into the name, such as organs/{}.stl",
          option, path, kPattern, kPattern));
}

template <int Dim>
std::vector<ObjectInput<Dim>> objects_of(
    const CLI::App& command, const RunArguments& a, const surf::segment::Options<Dim>& options,
    const std::vector<surf::segment::BoxCorners<Dim>>& boxes_mm,
    const std::vector<std::vector<Click<Dim>>>& strokes) {
  std::vector<ObjectInput<Dim>> out;
  if (a.objects.empty()) {
    out.push_back({"", options});
    if (!boxes_mm.empty()) out.back().options.box_mm = boxes_mm.front();
    for (const auto& some : strokes) add_strokes(some, out.back().strokes);
    return out;
  }
  std::size_t n_seeds = 0, n_outside = 0, n_boxes = 0, n_marks = 0;
  for (const CLI::Option* given : command.parse_order()) {
    if (given->check_lname("object")) {
      out.push_back({a.objects[out.size()], options});
      out.back().options.seeds_mm.clear();
      out.back().options.outside_mm.clear();
      out.back().options.click_order.clear();
    }
    if (given->check_lname("box")) out.back().options.box_mm = boxes_mm[n_boxes++];
    if (given->check_lname("seed")) {
      out.back().options.seeds_mm.push_back(options.seeds_mm[n_seeds++]);
      out.back().options.click_order.push_back(Side::kInside);
    }
    if (given->check_lname("outside")) {
      out.back().options.outside_mm.push_back(options.outside_mm[n_outside++]);
      out.back().options.click_order.push_back(Side::kOutside);
    }
    if (given->check_lname("marks")) add_strokes(strokes[n_marks++], out.back().strokes);
  }
  for (const ObjectInput<Dim>& object : out)
    if (object.options.seeds_mm.empty() && !has_inside(object.strokes))
      throw surf::InputError(
          fmt::format("--object {}: has neither a --seed nor a stroke inside, label 1 of --marks",
                      object.name));
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                   \
  template std::vector<ObjectInput<Dim>> objects_of<Dim>(                       \
      const CLI::App&, const RunArguments&, const surf::segment::Options<Dim>&, \
      const std::vector<surf::segment::BoxCorners<Dim>>&,                       \
      const std::vector<std::vector<Click<Dim>>>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surfseg
