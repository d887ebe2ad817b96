// surfseg-slicer: a command line module of 3D Slicer and MITK.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "libsurf/base/log.h"
#include "tools/common/program.h"
#include "tools/slicer/cli/description.h"
#include "tools/slicer/cli/points_command.h"

namespace {

using namespace surfseg;
using namespace surfseg::slicer;

constexpr const char* kFooter =
    "Points are LPS mm, as hosts pass them. Surface and label map are those of `surfseg segment\n"
    "--space lps` with the same points as --seed and --outside, to the byte.\n\n"
    "Example:\n"
    "  surfseg-slicer head.nrrd --inside 28.5,28,29 --surface ventricles.vtp\n"
    "Exit codes: 0 done, 2 usage, 3 input, 4 output, 5 stopped at the iteration limit (result\n"
    "written), 6 result fails a guarantee, 8 no object found (not written), 130/143/152 "
    "interrupted\n"
    "(last surface written).";

void add_description(CLI::App& app, const std::string& name, const std::vector<Group>& groups,
                     Dialect dialect, const std::string& help) {
  const auto print = [&groups, dialect] {
    throw Listing{description(groups, SURFSEG_VERSION, dialect)};
  };
  app.add_flag_callback(name, print, help)->trigger_on_parse();
}

ExitCode segment(const CLI::App& app, const std::vector<Parameter>& parameters,
                 const Arguments& arguments) {
  check(arguments, parameters);
  const SegmentOptions options(segment_words(app, parameters, arguments));
  SurfaceFiles files;
  files.volume = arguments.volume;
  files.output = arguments.value("surface");
  files.mask = arguments.value("labels");
  Tags tags(arguments.progress == "tags");
  const ExitCode code = PointsCommand(options, files, arguments.return_file, tags).run();
  tags.end();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  surf::set_log_sink([](surf::LogLevel, const std::string&) {});
  CLI::App app{"A closed surface from points in a volume, for 3D Slicer and MITK.",
               "surfseg-slicer"};
  std::vector<Group> groups;
  std::vector<Parameter> parameters;
  bool is_parsed = false;  // from then on messages are about options of `surfseg segment`
  return run_guarded(
      app,
      [&] {
        groups = parameter_groups();
        parameters = parameters_of(groups);
        Arguments arguments;
        app.set_version_flag("--version", fmt::format("surfseg-slicer {}", SURFSEG_VERSION));
        app.get_formatter()->column_width(34);
        app.footer(kFooter);
        add_parameters(app, parameters, arguments);
        add_description(app, "--xml", groups, Dialect::kCtk,
                        "Print the description of this module in XML, by CTK's schema");
        add_description(app, "--xml_slicer", groups, Dialect::kSlicer,
                        "Print it as Slicer wants it beside the program: what is given back has "
                        "no index");
        app.parse(argc, argv);
        is_parsed = true;
        return segment(app, parameters, arguments);
      },
      [&](const std::string& message) {
        return is_parsed ? with_flags(message, parameters) : message;
      });
}
