#include "tools/batch/run_case.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "tools/batch/derivatives.h"
#include "tools/batch/fingerprint.h"
#include "tools/batch/partial_folder.h"
#include "tools/batch/table.h"
#include "tools/common/html.h"
#include "tools/common/program.h"
#include "tools/common/report.h"
#include "tools/common/signals.h"
#include "tools/surfseg/commands.h"

namespace surfseg::batch {
namespace {

// Where they are is in the row's space.
constexpr std::array kColumnsInSpace = {"box", "initial-box", "initial-ball", "initial-ellipsoid",
                                        "landmarks"};

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// `surfseg VERB WORDS...` in this process.
ExitCode run_verb(void (*add)(CLI::App&, ExitCode&), std::vector<std::string> words) {
  ExitCode exit_code = kDone;
  CLI::App app;
  add(app, exit_code);
  std::reverse(words.begin(), words.end());  // as the parser wants them
  app.parse(std::move(words));
  return exit_code;
}

std::string text_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A recipe's object has the name that it was added with; the names that it was given later, and
/// that were not undone, are in its history.
std::string name_at_the_end(const ordered_json& object) {
  std::string out = object.at("name").get<std::string>();
  for (const ordered_json& entry : object.at("history"))
    if (entry.at("do") == "rename") out = entry.at("name").get<std::string>();
  return out;
}

/// Times and memory are not the same twice.
void drop_measured(ordered_json& json) {
  if (json.is_object())
    for (const char* key : {"time_s", "cpu_s", "stages", "peak_memory_mb"}) json.erase(key);
  if (json.is_structured())
    for (ordered_json& entry : json) drop_measured(entry);
}

/// Null where there is no reference, or it could not be compared.
ordered_json dice_of(const ordered_json& summary) {
  const auto reference = summary.find("reference");
  return reference == summary.end() ? ordered_json() : reference->value("dice", ordered_json());
}

/// All that was written of it is there, from what is_same says of its summary.
bool is_there(const Case& row, const fs::path& folder,
              const std::function<bool(const ordered_json&)>& is_same) {
  const fs::path path = folder / summary_file(row.name);
  if (!fs::exists(path)) return false;
  try {
    const ordered_json summary = read_json(path.string());
    if (!is_same(summary) || !is_success(summary.value("exit_code", -1))) return false;
    for (const auto& name : summary.at("files"))
      if (!fs::exists(folder / name.get<std::string>())) return false;
    return true;
  } catch (const std::exception&) {
    return false;  // it is not one of ours, or damaged
  }
}

bool is_done(const Case& row, const fs::path& folder, const std::string& input) {
  return is_there(row, folder,
                  [&](const ordered_json& summary) { return summary.value("input", "") == input; });
}

/// A case on its way: all it writes goes to a folder beside its own.
class CaseRun {
 public:
  /// @param row  is kept
  CaseRun(const Case& row, const std::string& folder, std::string input)
      : row_(row), folder_(folder), input_(std::move(input)), partial_(folder, row.name) {
    for (const char* part : {"anat", "figures"})
      fs::create_directories(partial_.path() / case_folder(row.name) / part);
  }
  CaseRun(const CaseRun&) = delete;
  CaseRun& operator=(const CaseRun&) = delete;

  CaseOutcome run() {
    CaseOutcome out;
    try {
      const bool is_replay = !row_.recipe.empty();
      objects_ = is_replay ? objects_of_recipe() : row_.clicks.objects;
      files_.emplace(row_.name, objects_.size() > 1);
      out.exit_code = run_verb(is_replay ? add_replay_command : add_segment_command, words());
    } catch (...) {
      out = outcome_of(std::current_exception());
    }
    try {  // of several objects some may be there
      const bool is_any = is_success(out.exit_code) || out.exit_code == kBatchFailed;
      if (is_any && signal_exit_code() == kDone) finish();
    } catch (...) {
      out = outcome_of(std::current_exception());
    }
    if (const ExitCode signal = signal_exit_code(); signal != kDone) return {false, signal, ""};
    clean_report();
    commit(out);
    return out;
  }

 private:
  std::string at(const std::string& name) const { return (partial_.path() / name).string(); }
  /// Without the folder that nobody sees.
  std::string relative(std::string text) const {
    const std::string prefix = partial_.path().string() + "/";
    for (const std::string& form : {prefix, html_text(prefix)})
      for (std::size_t at = text.find(form); at != std::string::npos; at = text.find(form, at))
        text.erase(at, form.size());
    return text;
  }

  CaseOutcome outcome_of(const std::exception_ptr& error) const {
    const Failure failure = failure_of(error, "surfseg");
    return {false, failure.exit_code, reason(relative(failure.message))};
  }

  /// Without the name of the only surface, which says nothing here.
  std::string reason(const std::string& message) const {
    const std::string prefix = files_ ? files_->surface + ": not written: " : "";
    return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
  }

  /// Names that a label can have; several objects of a recipe need not have such ones.
  /// @throws surf::UsageError  one label for several
  /// @throws surf::InputError  a name that is none
  std::vector<std::string> objects_of_recipe() const {
    const ordered_json recipe = read_json(row_.recipe);
    std::vector<std::string> out;
    try {
      for (const auto& object : recipe.at("objects")) out.push_back(name_at_the_end(object));
    } catch (const ordered_json::exception&) {
      return {};  // it is broken, which replay says best
    }
    if (out.size() < 2) return out;
    if (!row_.reference_label.empty())
      throw surf::UsageError(
          "reference-label: several objects have the labels 1, 2, ...; leave it empty");
    for (const std::string& name : out)
      if (!is_label(name))
        throw surf::InputError(
            fmt::format("{}: object '{}': expected a name of letters and digits, as BIDS has it",
                        row_.recipe, name));
    return out;
  }

  std::vector<std::string> words() const {
    std::vector<std::string> out =
        row_.recipe.empty()
            ? std::vector<std::string>{"segment", row_.scan}
            : std::vector<std::string>{"replay", row_.recipe, "--volume=" + row_.scan};
    out.insert(out.end(), row_.options.begin(), row_.options.end());
    if (row_.recipe.empty()) {
      const auto clicks = click_words();
      out.insert(out.end(), clicks.begin(), clicks.end());
      out.push_back("--recipe=" + at(files_->recipe));
    }
    for (const auto& [option, name] : {std::pair{"output", files_->surface},
                                       {"mask", files_->labels},
                                       {"picture", files_->picture},
                                       {"thumbnail", files_->thumbnail},
                                       {"report", files_->report},
                                       {"json", summary_file(row_.name)}})
      out.push_back(fmt::format("--{}={}", option, at(name)));
    if (!row_.reference.empty()) out.push_back("--reference=" + row_.reference);
    if (!row_.reference_label.empty()) out.push_back("--reference-label=" + row_.reference_label);
    out.push_back("--quiet");
    return out;
  }

  std::vector<std::string> click_words() const {
    std::string space = row_.space;
    std::vector<std::string> out;
    if (!row_.clicks.file.empty()) {
      out = landmark_words(row_.clicks.file, space);
      const bool has_others =
          !row_.clicks.words.empty() ||
          std::any_of(kColumnsInSpace.begin(), kColumnsInSpace.end(), [&](const char* column) {
            if (!row_.settings.contains(column)) return false;
            const std::string ending = surf::extension(row_.settings.at(column));
            return ending != ".json" && ending != ".fcsv";  // these state it, too
          });
      if (space != row_.space && has_others)
        throw surf::UsageError(
            fmt::format("clicks: {}: states its space; 'outside', '{}' beside it need 'space' to "
                        "be ras",
                        row_.clicks.file, fmt::join(kColumnsInSpace, "', '")));
    }
    out.push_back("--space=" + space);
    out.insert(out.end(), row_.clicks.words.begin(), row_.clicks.words.end());
    return out;
  }

  /// The command line in it names files as they will lie.
  void clean_report() const {
    if (!files_ || !fs::exists(at(files_->report))) return;
    surf::write_bytes(at(files_->report), relative(text_of(at(files_->report))));
  }

  /// What is beside the files of the verb.
  void finish() {
    if (!row_.recipe.empty()) fs::copy_file(row_.recipe, at(files_->recipe));
    if (!fs::exists(at(files_->labels))) return;
    ordered_json sidecar = {{"Sources", {row_.settings.at("scan")}}};
    if (files_->label_names.empty()) sidecar["Type"] = "ROI";
    write_json(at(files_->sidecar), sidecar);
    if (files_->label_names.empty()) return;
    std::string table = "index\tname\n";
    for (std::size_t n = 0; n < objects_.size(); ++n)
      table += fmt::format("{}\t{}\n", n + 1, objects_[n]);
    surf::write_bytes(at(files_->label_names), table);
  }

  /// What the verb has written, and what the report needs besides.
  ordered_json summary(const CaseOutcome& outcome) const {
    const std::string path = at(summary_file(row_.name));
    ordered_json of_verb =
        fs::exists(path) ? ordered_json::parse(relative(text_of(path))) : ordered_json::object();
    drop_measured(of_verb);
    ordered_json out = {{"surfseg", SURFSEG_VERSION}, {"name", row_.name}, {"input", input_}};
    out["settings"] = row_.settings;
    out["exit_code"] = int(outcome.exit_code);
    if (!outcome.message.empty()) out["message"] = outcome.message;
    of_verb.erase("surfseg");
    of_verb.erase("exit_code");
    out.update(of_verb);
    if (!out.contains("objects"))
      out["dice"] = dice_of(out);
    else
      for (ordered_json& object : out["objects"]) object["dice"] = dice_of(object);
    return out;
  }

  /// Files with something in them, but for the summary.
  std::vector<std::string> written() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(partial_.path()))
      if (entry.is_regular_file())
        out.push_back(entry.path().lexically_relative(partial_.path()).generic_string());
    std::sort(out.begin(), out.end());
    std::erase(out, summary_file(row_.name));
    return out;
  }

  /// An empty folder, but for what is not ours.
  static void clear(const fs::path& folder) {
    fs::create_directories(folder);
    std::vector<fs::path> old;
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().filename().string().find("_desc-surfseg_") != std::string::npos)
        old.push_back(entry.path());
    for (const fs::path& path : old) fs::remove(path);
  }

  /// The summary goes first and comes last: where one is, all is. Another run may have done the
  /// same meanwhile.
  void commit(CaseOutcome& outcome) {
    const FolderLock lock(folder_);
    if (is_done(row_, folder_, input_)) return;
    try {
      ordered_json document = summary(outcome);
      const std::vector<std::string> names = written();
      document["files"] = names;
      const fs::path own = folder_ / case_folder(row_.name);
      fs::remove(folder_ / summary_file(row_.name));
      for (const char* part : {"anat", "figures"}) clear(own / part);
      for (const std::string& name : names) fs::rename(partial_.path() / name, folder_ / name);
      write_json((folder_ / summary_file(row_.name)).string(), document);
    } catch (...) {
      outcome = {false, kOutput, failure_of(std::current_exception(), "surfseg").message};
    }
  }

  const Case& row_;
  fs::path folder_;
  std::string input_;
  PartialFolder partial_;
  std::vector<std::string> objects_;
  std::optional<CaseFiles> files_;
};

/// From the same row, whatever its files hold by now.
bool was_done(const Case& row, const fs::path& folder) {
  return is_there(row, folder, [&](const ordered_json& summary) {
    return summary.value("settings", ordered_json()) == ordered_json(row.settings);
  });
}

}  // namespace

bool is_success(int exit_code) { return exit_code == kDone || exit_code == kStoppedAtLimit; }

CaseOutcome run_case(const Case& row, const std::string& folder) {
  try {
    // On a share that is away for a moment: what was made of the case stays.
    for (const std::string& file : row.files) {
      const int error = ::access(file.c_str(), R_OK) == 0 ? 0 : errno;
      if (error != 0 && was_done(row, folder))
        throw surf::InputError(fmt::format(
            "{}: cannot be read: {}; what was made of the case before is left as it was", file,
            std::strerror(error)));
    }
    std::string input = fingerprint(row);
    if (is_done(row, folder, input)) {
      const int code = read_json((fs::path(folder) / summary_file(row.name)).string())["exit_code"];
      return {true, ExitCode(code), ""};
    }
    return CaseRun(row, folder, std::move(input)).run();
  } catch (const fs::filesystem_error& error) {  // what is read is looked at above
    return {false, kOutput, error.what()};
  } catch (...) {
    const Failure failure = failure_of(std::current_exception(), "surfseg");
    return {false, failure.exit_code == kInternal ? kOutput : failure.exit_code, failure.message};
  }
}

}  // namespace surfseg::batch
