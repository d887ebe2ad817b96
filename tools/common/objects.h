// Several objects on one command line: whose clicks are whose, and where each is written.
#pragma once

#include <string>
#include <vector>

#include "libsurf/segment/options.h"
#include "tools/common/cli_app.h"
#include "tools/common/outputs.h"
#include "tools/common/run_arguments.h"

namespace surfseg {

/// An object to look for, with its clicks among the options.
template <int Dim>
struct ObjectInput {
  std::string name;  ///< "" = the only one, without a name
  surf::segment::Options<Dim> options;
  std::vector<surf::segment::Click<Dim>> strokes = {};  ///< of its --marks
};

/// --object
void add_object_option(CLI::App& command, RunArguments& a);

/// Names in a file's name: "{object}" is replaced by the object's.
bool has_object(const std::string& pattern);
std::string object_path(const std::string& pattern, const std::string& name);

/// @throws surf::UsageError  a file that tells of all objects has {object} in its name
void check_is_of_all(const std::string& option, const std::string& path);

/// Each output with the objects' names, without doubles, and the files beside those of -o: for
/// check_outputs().
/// @param names  none = as they are
std::vector<Output> object_outputs(const std::vector<Output>& patterns,
                                   const std::vector<std::string>& names);

/// Files that a run reads: `own`, those of --marks, and that of --config, but where the summary
/// takes its place.
std::vector<Output> read_files(const RunArguments& a, std::vector<Output> own);

/// What is wrong with --object itself, and with the names of files that are written for each
/// object: with several they need {object}.
/// @param each  outputs of which there is one for each object
/// @throws surf::UsageError  a name twice or unfit for a file's name, an object without --seed or
///                           --marks, a click before the first object, objects or what one of them
///                           has from a --config, two boxes of one
void check_objects(const CLI::App& command, const RunArguments& a, const std::vector<Output>& each);

/// Whether files may have the name of an object in theirs.
bool is_fit_for_a_file(const std::string& name);

/// @throws surf::UsageError  a name is there twice, or is unfit for a file's name
void check_object_names(const std::vector<std::string>& names);

/// The objects in their order, each with its own of the clicks in `options`, of the boxes and of
/// the strokes; one without a name if there is no --object.
/// @param boxes_mm  of RunArguments::boxes
/// @param strokes   of each of a.marks
/// @throws surf::InputError  an object has neither a seed nor a stroke inside
template <int Dim>
std::vector<ObjectInput<Dim>> objects_of(
    const CLI::App& command, const RunArguments& a, const surf::segment::Options<Dim>& options,
    const std::vector<surf::segment::BoxCorners<Dim>>& boxes_mm = {},
    const std::vector<std::vector<surf::segment::Click<Dim>>>& strokes = {});

}  // namespace surfseg
