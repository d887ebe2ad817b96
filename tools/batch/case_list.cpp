#include "tools/batch/case_list.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <exception>
#include <filesystem>

#include "libsurf/base/error.h"
#include "libsurf/base/nearest_name.h"
#include "tools/batch/table.h"
#include "tools/common/config.h"
#include "tools/common/objects.h"
#include "tools/common/program.h"
#include "tools/surfseg/commands.h"

namespace surfseg::batch {
namespace {

using surf::InputError;
using surf::UsageError;

/// Columns that are no options of segment, or not spelled as there.
const std::vector<std::string> kOwn = {"name",   "scan",      "clicks",         "outside",
                                       "recipe", "reference", "reference-label"};
/// Options of segment that a list has no say in, or columns of its own.
constexpr std::array kNotInLists = {"help",       "output",    "seed",
                                    "object",     "mask",      "picture",
                                    "start",      "denoised",  "thumbnail",
                                    "candidates", "json",      "config",
                                    "recipe",     "threads",   "quiet",
                                    "profile",    "verbose",   "output-space",
                                    "report",     "reference", "reference-label",
                                    "checkpoint", "resume",    "memory"};
/// Which image of the scan's file or folder it is: a recipe need not say it.
constexpr std::array kOfTheScan = {"frame-index", "series-uid"};
constexpr std::array kFileOptions = {"marks", "initial", "landmarks"};

/// `surfseg segment`, to be asked for its options.
class SegmentOptions {
 public:
  SegmentOptions() {
    add_segment_command(app_, exit_code_);
    command_ = app_.get_subcommand("segment");
    for (const std::string& name : option_names(*command_))
      if (std::find(kNotInLists.begin(), kNotInLists.end(), name) == kNotInLists.end())
        names_.push_back(name);
  }
  bool has(const std::string& name) const {
    return std::find(names_.begin(), names_.end(), name) != names_.end();
  }
  bool is_flag(const std::string& name) const { return find(name).get_expected_min() == 0; }
  bool is_repeatable(const std::string& name) const {
    return find(name).get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  const CLI::Option& find(const std::string& name) const {
    return *command_->get_option("--" + name);
  }

  CLI::App app_;
  ExitCode exit_code_ = kDone;
  CLI::App* command_ = nullptr;
  std::vector<std::string> names_;
};

void check_columns(const Table& table, const SegmentOptions& options, const std::string& path) {
  std::vector<std::string> known = kOwn;
  known.insert(known.end(), options.names().begin(), options.names().end());
  for (const std::string& column : table.columns)
    if (std::find(known.begin(), known.end(), column) == known.end())
      throw InputError(fmt::format("{}: '{}' is not a column: they are {} and options of segment{}",
                                   path, column, fmt::join(kOwn, ", "),
                                   surf::did_you_mean(column, known)));
  for (const char* needed : {"name", "scan"})
    if (std::find(table.columns.begin(), table.columns.end(), needed) == table.columns.end())
      throw InputError(
          fmt::format("{}: there is no column '{}'; the first line names the columns, "
                      "apart by tabs",
                      path, needed));
}

bool is_yes(const std::string& column, const std::string& text) {
  for (const char* yes : {"yes", "true", "1"})
    if (text == yes) return true;
  for (const char* no : {"no", "false", "0"})
    if (text == no) return false;
  throw UsageError(fmt::format("{}: expected yes or no; got '{}'", column, text));
}

/// Makes a case of a row.
class RowReader {
 public:
  /// @param list_folder, options, defaults  are kept
  RowReader(const std::filesystem::path& list_folder, const SegmentOptions& options,
            const CaseDefaults& defaults)
      : folder_(list_folder), options_(options), defaults_(defaults) {}

  /// @throws UsageError
  Case read(const TableRow& row) const {
    Case out;
    out.line = row.line;
    out.settings = row.cells;
    out.settings.erase("name");
    out.stated = out.settings;
    out.name = name_of(row);
    out.scan = file(taken(row, "scan"), out);
    if (out.scan.empty()) throw UsageError("scan: a volume is missing");
    out.recipe = file(taken(row, "recipe"), out);
    out.reference = file(taken(row, "reference"), out);
    check_is_of_all("reference", out.reference);
    out.reference_label = taken(row, "reference-label");
    if (out.reference_label.find_first_not_of("0123456789") != std::string::npos ||
        out.reference_label.size() > 9)
      throw UsageError(fmt::format("reference-label: expected a label, such as 2; got '{}'",
                                   out.reference_label));
    if (out.recipe.empty())
      read_clicks(row, out);
    else
      read_recipe(row, out);
    return out;
  }

 private:
  static std::string taken(const TableRow& row, const std::string& column) {
    const auto found = row.cells.find(column);
    return found == row.cells.end() ? "" : found->second;
  }

  static std::string name_of(const TableRow& row) {
    std::string name = taken(row, "name");
    if (name.starts_with("sub-")) name.erase(0, 4);
    if (!is_label(name))
      throw UsageError(fmt::format(
          "name: expected letters and digits, such as case01, as BIDS has it; got '{}'", name));
    return name;
  }

  std::string file(const std::string& name, Case& out) const {
    if (name.empty()) return "";
    out.files.push_back((folder_ / name).lexically_normal().string());
    return out.files.back();
  }

  void read_recipe(const TableRow& row, Case& out) const {
    for (const auto& [column, text] : row.cells)
      if (std::find(kOfTheScan.begin(), kOfTheScan.end(), column) != kOfTheScan.end())
        add_option(column, text, out);
      else if (column == "clicks" || column == "outside" || options_.has(column))
        throw UsageError(
            fmt::format("{}: the recipe says it already; leave one of the two empty", column));
    check(out);
  }

  void read_clicks(const TableRow& row, Case& out) const {
    for (const auto& [column, value] :
         {std::pair{"space", &defaults_.space}, {"preset", &defaults_.preset}})
      if (!value->empty()) out.settings.try_emplace(column, *value);
    out.space = out.settings["space"];
    out.clicks = parse_clicks(taken(row, "clicks"));
    if (!out.clicks.file.empty()) out.clicks.file = file(out.clicks.file, out);
    if (out.clicks.objects.size() > 1) check_several(row);
    for (const auto& [column, text] : out.settings)
      if (options_.has(column) && column != "space" && column != "outside")
        add_option(column, text, out);
    const auto outside = point_words("outside", taken(row, "outside"));
    out.clicks.words.insert(out.clicks.words.end(), outside.begin(), outside.end());
    check(out);
  }

  /// What would be of the last object alone.
  static void check_several(const TableRow& row) {
    if (!taken(row, "outside").empty())
      throw UsageError(
          "outside: of which of the objects? Write each point with ! behind the object in the cell "
          "of clicks, such as liver: 12,-30,44; !20,-30,44; kidney: 60,10,2");
    if (!taken(row, "reference-label").empty())
      throw UsageError(
          "reference-label: several objects have the labels 1, 2, ...; leave it empty");
  }

  void add_option(const std::string& column, const std::string& text, Case& out) const {
    if (options_.is_flag(column)) {
      if (is_yes(column, text)) out.options.push_back("--" + column);
      return;
    }
    const bool is_file =
        std::find(kFileOptions.begin(), kFileOptions.end(), column) != kFileOptions.end();
    for (const std::string& part :
         options_.is_repeatable(column) ? parts_of(text) : std::vector{text})
      out.options.push_back(fmt::format("--{}={}", column, is_file ? file(part, out) : part));
  }

  static void check(const Case& row) {
    std::vector<std::string> words = row.options;
    if (row.recipe.empty()) words.push_back("--space=" + row.space);
    if (!row.clicks.file.empty() || !row.recipe.empty())
      words.push_back("--seed=0,0,0");  // as the file says, or the recipe
    words.insert(words.end(), row.clicks.words.begin(), row.clicks.words.end());
    for (const std::string& word : words)
      if (word.ends_with("=list")) throw UsageError(word.substr(2) + ": prints a list; it is none");
    check_segment(words);
  }

  const std::filesystem::path& folder_;
  const SegmentOptions& options_;
  const CaseDefaults& defaults_;
};

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

}  // namespace

std::vector<Case> read_cases(const std::string& path, const CaseDefaults& defaults) {
  const Table table = read_table(path);
  const SegmentOptions options;
  check_columns(table, options, path);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const RowReader reader(folder, options, defaults);
  std::vector<Case> out;
  std::map<std::string, int> lines;  // of names: some file systems take a and A for the same
  for (const TableRow& row : table.rows) {
    const std::string where = fmt::format("{}:{}", path, row.line);
    try {
      out.push_back(reader.read(row));
    } catch (...) {
      throw InputError(
          fmt::format("{}: {}", where, failure_of(std::current_exception(), "surfseg").message));
    }
    const auto [first, is_new] = lines.try_emplace(in_lower_case(out.back().name), row.line);
    if (!is_new)
      throw InputError(fmt::format("{}: name: '{}' is there already, in line {}", where,
                                   out.back().name, first->second));
  }
  if (out.empty()) throw InputError(fmt::format("{}: has no rows", path));
  return out;
}

}  // namespace surfseg::batch
