// What the replay commands of both programs do: a recipe in, what its object is at the end out.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "libsurf/segment/segmentation.h"
#include "tools/common/cli_app.h"
#include "tools/common/run_arguments.h"
#include "tools/common/segment_command.h"

namespace surfseg {

/// A recipe's file, and which object of it; the rest are outputs.
struct ReplayArguments : RunArguments {
  std::string path, object;
};

/// RECIPE, --object and the options of running.
void add_replay_arguments(CLI::App& command, ReplayArguments& a);

/// The recipe's text.
/// @throws surf::UsageError  none was named
/// @throws surf::InputError  cannot be read
std::string read_recipe(const ReplayArguments& a);

/// @throws surf::InputError  the recipe is none, or the other program's
void check_dimension(const ReplayArguments& a, const std::string& recipe, int dimension);

/// The file of the recipe's image: `chosen` if there is one, else as the recipe names it, beside
/// the recipe if it is not there.
/// @param option  that would name it
/// @throws surf::UsageError  the recipe names none
std::string image_file(const ReplayArguments& a, const std::string& recipe,
                       const std::string& chosen, const std::string& option);

/// The series of the recipe's image; "" if the recipe names none, or `chosen` is no folder that has
/// it.
/// @throws surf::InputError  `chosen` is a folder without a DICOM image
std::string image_series(const ReplayArguments& a, const std::string& recipe,
                         const std::string& chosen);

/// The result of an object that does not heed what was done last: with a note that says so, and
/// without a verdict.
template <int Dim>
std::shared_ptr<const surf::segment::Result<Dim>> outdated(
    const surf::segment::Result<Dim>& result);

/// Does all that the recipe says.
/// @param setting  the image
/// @param output  with {object} all objects are wanted if none is asked for
/// @param check_names  is told the names of those that are wanted before anything is computed
/// @return  all objects; wanted is the one that was asked for, or the only one
/// @throws surf::InputError  as segment::replay(), with the recipe's file
/// @throws surf::UsageError  there is no such object, or several, none was asked for and `output`
///                           is no pattern
template <int Dim>
std::vector<SegmentedObject<Dim>> replayed(
    const ReplayArguments& a, const std::string& recipe, const std::string& output,
    const std::shared_ptr<const surf::segment::Setting<Dim>>& setting,
    const std::function<void(const std::vector<std::string>&)>& check_names,
    const surf::segment::ProgressOf<Dim>& progress);

}  // namespace surfseg
