#include "tools/common/typed_options.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>

#include "libsurf/base/decimal_points.h"
#include "libsurf/base/error.h"
#include "libsurf/base/nearest_name.h"
#include "tools/common/config.h"
#include "tools/common/preset_arguments.h"
#include "tools/common/program.h"
#include "tools/common/run_arguments.h"

namespace surfseg {
namespace {

/// The parser alone does not say what may have been meant.
void check_names(const CLI::App& command, const std::vector<std::string>& words) {
  const std::vector<std::string> known = option_names(command);
  for (const std::string& word : words) {
    if (word.rfind("--", 0) != 0) continue;
    const std::string name = word.substr(2, word.find('=') - 2);
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw surf::UsageError(
          fmt::format("--{} is not an option{}", name, surf::did_you_mean(name, known)));
  }
}

}  // namespace

template <int Dim>
surf::segment::Options<Dim> typed_options(std::vector<std::string> words, double cell_mm) {
  const RunWords& of_image = Dim == 3 ? kVolumeWords : kImageWords;
  RunArguments arguments;
  CLI::App command{"", "segment"};
  command.set_help_flag();
  add_start_options(command, arguments, of_image);
  add_run_options(command, arguments, of_image);
  add_preset_option(command, arguments.preset, "");
  check_names(command, words);
  std::reverse(words.begin(), words.end());  // as the parser wants them
  const surf::DecimalPoints points;          // it reads by strtold()
  try {
    command.parse(std::move(words));
    apply_files(command, "", arguments.preset);
  } catch (const Listing&) {
    throw surf::UsageError("'list' prints; it names no energy or preset");
  } catch (const CLI::Success&) {
    throw surf::UsageError("'list' prints; it names no energy or preset");
  } catch (const CLI::ParseError& error) {
    throw surf::UsageError(error.what());
  }
  if (!arguments.seeds.empty() || !arguments.outside.empty() || !arguments.boxes.empty())
    throw surf::UsageError(
        "--seed, --outside, --box: clicks and boxes are given apart from options");
  check_run_arguments(command, arguments, of_image);
  surf::segment::Options<Dim> out;
  set_run_options<Dim>(command, arguments, cell_mm, out);
  return out;
}

template surf::segment::Options<2> typed_options<2>(std::vector<std::string>, double);
template surf::segment::Options<3> typed_options<3>(std::vector<std::string>, double);

}  // namespace surfseg
