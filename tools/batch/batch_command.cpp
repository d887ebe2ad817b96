// surfseg batch: a list of scans and clicks in, a folder of derivatives and a page of them out.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <filesystem>
#include <memory>

#include "libsurf/base/error.h"
#include "tools/batch/batch_run.h"
#include "tools/batch/case_list.h"
#include "tools/batch/cohort.h"
#include "tools/batch/derivatives.h"
#include "tools/batch/partial_folder.h"
#include "tools/common/option_group.h"
#include "tools/common/program.h"
#include "tools/common/run_arguments.h"
#include "tools/common/signals.h"
#include "tools/surfseg/commands.h"

namespace surfseg {
namespace {

using surf::UsageError;

/// The options as they were typed.
struct Arguments {
  std::string list, output, shard;
  batch::CaseDefaults defaults;
  bool collect = false, quiet = false;
  int jobs = 1, threads = 0;
};

/// One part of all cases: number `index` of `count`, from 1.
struct Shard {
  int index = 1, count = 1;
};

Shard parse_shard(const std::string& text) {
  Shard out;
  if (text.empty()) return out;
  int end = 0;
  if (std::sscanf(text.c_str(), "%9d/%9d%n", &out.index, &out.count, &end) != 2 ||
      std::size_t(end) != text.size() || out.index < 1 || out.index > out.count)
    throw UsageError(
        fmt::format("--shard: expected I/N with I from 1 to N, such as 2/8; got '{}'", text));
  return out;
}

std::vector<batch::Case> part_of(const std::vector<batch::Case>& all, const Shard& shard) {
  std::vector<batch::Case> out;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (int(n % std::size_t(shard.count)) == shard.index - 1) out.push_back(all[n]);
  return out;
}

void check(const Arguments& a) {
  check_range("--jobs", a.jobs, 1, "1 or more");
  check_range("--threads", a.threads, 0, "0 (all) or more");
  if (a.defaults.preset == "list")
    throw UsageError("--preset list: prints; `surfseg segment --preset list` does");
  if (a.collect && !a.shard.empty())
    throw UsageError("--collect, --shard: it collects all shards; leave --shard out");
}

/// Writes the table and the page; "60 objects: 3 failed, 57 done; verdicts: 30 trusted, 20 check,
/// 7 doubtful; 2 outliers: DIR/group.html".
std::string report(const Arguments& a, const std::vector<batch::Case>& cases) {
  const std::vector<batch::Entry> entries = batch::collect(cases, a.output);
  batch::write_group(entries, a.output);
  std::map<batch::State, int> counts;
  std::map<std::string, int> verdicts;
  int n_outliers = 0;
  for (const batch::Entry& entry : entries) {
    ++counts[entry.state];
    if (!entry.verdict.empty()) ++verdicts[entry.verdict];
    n_outliers += entry.state != batch::State::kFailed && !entry.outlier_in.empty();
  }
  std::string out;
  for (const auto& [state, n] : counts)
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", n, to_string(state));
  if (entries.size() != cases.size()) out = fmt::format("{} objects: {}", entries.size(), out);
  const char* separator = "; verdicts:";
  for (const char* verdict : {"trusted", "check", "doubtful"}) {
    if (verdicts.count(verdict) == 0) continue;
    out += fmt::format("{} {} {}", std::exchange(separator, ","), verdicts.at(verdict), verdict);
  }
  return fmt::format("{}; {} outlier{}: {}", out, n_outliers, n_outliers == 1 ? "" : "s",
                     (std::filesystem::path(a.output) / "group.html").string());
}

ExitCode run(const Arguments& a) {
  check(a);
  const Shard shard = parse_shard(a.shard);
  const std::vector<batch::Case> cases = batch::read_cases(a.list, a.defaults);
  batch::prepare_derivatives(a.output);
  batch::remove_left_partial_folders(a.output);
  const Verbosity verbosity = a.quiet ? Verbosity::kQuiet : Verbosity::kNormal;
  batch::RunCounts counts;
  if (!a.collect)
    counts = batch::run_cases(part_of(cases, shard), {a.output, a.jobs, a.threads, verbosity});
  ProgressLine(verbosity).note(report(a, cases));
  if (const ExitCode signal = signal_exit_code(); signal != kDone) return signal;
  if (counts.n_failed > 0)
    throw PartFailed(
        fmt::format("{} of {} cases failed, see above; those without a result come first in {}",
                    counts.n_failed, counts.n_done + counts.n_skipped + counts.n_failed,
                    (std::filesystem::path(a.output) / "group.html").string()));
  return kDone;
}

void add_options(CLI::App& command, Arguments& a) {
  command
      .add_option(
          "LIST", a.list,
          "Table, cells apart by tabs, a case in each row. Columns: name, scan, clicks such "
          "as 12,-30,44; !20,-30,44 (! outside) or a file of landmarks, outside, recipe "
          "in place of clicks, reference, reference-label, and options of `surfseg segment` "
          "such as preset or edge-length. Files are looked for from its folder on")
      ->required();
  command.add_option("-o,--output", a.output, "Folder for all that is made")->required();
  const OptionGroup clicks(command, "Where a row says nothing");
  clicks.add_choice("--space", a.defaults.space, "Space of points: ras or lps in mm, or ijk voxels",
                    {"ras", "lps", "ijk"});
  clicks.add("--preset", a.defaults.preset, "Preset by name, such as kidney-ct");
  const OptionGroup running(command, "Running");
  running.add_with_default("--jobs", a.jobs, "Cases at once; the results are the same");
  running.add("--threads", a.threads, "Threads of all of them together [all]");
  running.add("--shard", a.shard, "Do part I of N of the cases, such as 2/8: on several machines");
  running.add_flag("--collect", a.collect,
                   "Do nothing but write group.tsv and group.html of what is there");
  running.add_flag("-q,--quiet", a.quiet, "Print errors only");
}

}  // namespace

void add_batch_command(CLI::App& app, ExitCode& exit_code) {
  const auto typed = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("batch", "Segment all scans of a list");
  add_options(*command, *typed);
  command->footer(
      "Examples:\n"
      "  surfseg batch kidneys.tsv -o derivatives/surfseg --preset kidney-ct --jobs 4\n"
      "  surfseg batch kidneys.tsv -o derivatives/surfseg --shard 2/8   # on each of 8 machines\n"
      "  surfseg batch kidneys.tsv -o derivatives/surfseg --collect     # then: group.html of all\n"
      "A case that is done is skipped as long as its row, its files and the program stay the "
      "same;\n"
      "one that failed is tried again, and stops no other.\n"
      "Exit codes: 0 done, 2 usage, 3 the list cannot be used (nothing was run), 4 output, 7 some\n"
      "cases failed, 130/143/152 interrupted (cases under way are dropped; the next run goes on).");
  command->callback([typed, &exit_code] { exit_code = run(*typed); });
}

}  // namespace surfseg
