#include "tools/batch/cohort.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "libsurf/base/error.h"
#include "tools/batch/derivatives.h"
#include "tools/batch/run_case.h"
#include "tools/common/report.h"

namespace surfseg::batch {
namespace {

using nlohmann::ordered_json;
using Values = std::vector<std::optional<double>>;

std::optional<double> number(const ordered_json& json, const char* key) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_number()) return std::nullopt;
  return json[key].get<double>();
}

std::string text(const ordered_json& json, const char* key) {
  return json.is_object() && json.contains(key) && json[key].is_string()
             ? json[key].get<std::string>()
             : "";
}

ordered_json part(const ordered_json& json, const char* key) {
  return json.is_object() && json.contains(key) ? json[key] : ordered_json();
}

std::optional<double> scaled(std::optional<double> value, double factor) {
  if (value) *value *= factor;
  return value;
}

/// In the order of kMetrics.
std::array<std::optional<double>, kNMetrics> values_of(const ordered_json& summary) {
  const auto volume = number(summary, "volume_mm3"), area = number(summary, "area_mm2");
  std::optional<double> sphericity;
  if (volume && area && *area > 0 && *volume > 0)
    sphericity = std::cbrt(std::numbers::pi * 36 * *volume * *volume) / *area;
  return {scaled(volume, 1e-3),
          scaled(area, 1e-2),
          number(summary, "triangles"),
          sphericity,
          number(part(summary, "certainty"), "share_without_edge"),
          number(part(summary, "verdict"), "likelihood"),
          volume ? number(summary, "border_share") : std::nullopt,
          number(summary, "dice")};
}

State state_of(int exit_code) {
  return exit_code == kDone      ? State::kDone
         : is_success(exit_code) ? State::kAtLimit
                                 : State::kFailed;
}

/// @param what  the summary, or its entry of one object
Entry entry_of(const Case& row, const ordered_json& summary, const ordered_json& what) {
  Entry out;
  out.name = row.name;
  out.scan = row.settings.at("scan");
  out.exit_code = int(number(what, "exit_code").value_or(kInternal));
  out.state = state_of(out.exit_code);
  for (const char* key : {"stop_message", "not_written", "message"})
    if (const std::string message = text(what, key); !message.empty()) out.message = message;
  out.verdict = text(part(what, "verdict"), "trust");
  if (out.state != State::kFailed) out.values = values_of(what);
  for (const auto& file : part(summary, "files"))
    if (file.is_string()) out.files.push_back(file.get<std::string>());
  out.files.push_back(summary_file(row.name));
  return out;
}

/// Whether it is of the scan, the clicks and the options that the list has by now. What the list
/// does not state came from the command line then, which a collecting one does not repeat.
bool is_of(const Case& row, const ordered_json& summary) {
  ordered_json its = summary.value("settings", ordered_json::object());
  for (const char* key : {"space", "preset"})
    if (!row.stated.contains(key)) its.erase(key);
  return its == ordered_json(row.stated);
}

Entry not_run(const Case& row) {
  Entry out;
  out.name = row.name;
  out.scan = row.settings.at("scan");
  return out;
}

/// One for each object; none if there is no summary.
std::vector<Entry> entries_of(const Case& row, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / summary_file(row.name);
  std::vector<Entry> out;
  if (!std::filesystem::exists(path)) return out;
  const ordered_json summary = read_json(path.string());
  if (!summary.is_object()) throw surf::InputError(path.string() + ": holds no summary");
  if (!is_of(row, summary)) {
    out.push_back(not_run(row));
    out.back().message = "its row has changed since it was run";
    return out;
  }
  if (!summary.contains("objects")) return {entry_of(row, summary, summary)};
  for (const ordered_json& object : summary["objects"]) {
    out.push_back(entry_of(row, summary, object));
    out.back().object = text(object, "name");
  }
  return out;
}

/// Of sorted values, between neighbours by their distance.
double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * double(sorted.size() - 1);
  const auto below = std::size_t(at), above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - double(below)) * (sorted[above] - sorted[below]);
}

double greatest_z(const Entry& entry) {
  double out = 0;
  for (std::size_t m = 0; m < kNMetrics; ++m)
    if (kMetrics[m].is_for_outliers && entry.z[m]) out = std::max(out, std::abs(*entry.z[m]));
  return out;
}

/// Objects of one name are compared with each other.
void compare(std::vector<Entry>& entries) {
  std::map<std::string, std::vector<Entry*>> kinds;
  for (Entry& entry : entries) kinds[entry.object].push_back(&entry);
  for (auto& [object, group] : kinds)
    for (std::size_t m = 0; m < kNMetrics; ++m) {
      Values x;
      for (const Entry* entry : group) x.push_back(entry->values[m]);
      const Values z = robust_z(x);
      for (std::size_t n = 0; n < group.size(); ++n) {
        group[n]->z[m] = z[n];
        if (kMetrics[m].is_for_outliers && z[n] && std::abs(*z[n]) > kOutlierZ)
          group[n]->outlier_in.push_back(kMetrics[m].key);
      }
    }
}

int rank(const Entry& entry) {
  if (entry.state == State::kFailed) return 0;
  if (entry.state == State::kNotRun) return 4;
  if (!entry.outlier_in.empty()) return 1;
  return entry.state == State::kAtLimit ? 2 : 3;
}

}  // namespace

std::string to_string(State state) {
  switch (state) {
    case State::kFailed:
      return "failed";
    case State::kAtLimit:
      return "stopped at a limit";
    case State::kDone:
      return "done";
    case State::kNotRun:
      break;
  }
  return "not run";
}

std::vector<std::optional<double>> robust_z(const std::vector<std::optional<double>>& x) {
  constexpr std::size_t kFewest = 5;
  constexpr double kRounding = 1e-9;    // of the median: what differs by less is the same
  constexpr double kQuartiles = 1.349;  // deviations between those of a normal distribution
  std::vector<double> known, away;
  for (const auto& value : x)
    if (value && std::isfinite(*value)) known.push_back(*value);
  Values out(x.size());
  if (known.size() < kFewest) return out;
  std::sort(known.begin(), known.end());
  const double middle = quantile(known, 0.5);
  double mean = 0;
  for (const double value : known) {
    const double distance = std::abs(value - middle);
    away.push_back(distance > kRounding * std::abs(middle) ? distance : 0);
    mean += away.back() / double(known.size());
  }
  std::sort(away.begin(), away.end());
  const double mad = quantile(away, 0.5), quartiles = quantile(known, 0.75) - quantile(known, 0.25),
               scale = mad > 0 ? std::max(mad / 0.6745, quartiles / kQuartiles) : 1.2533 * mean;
  for (std::size_t n = 0; n < x.size(); ++n)
    if (x[n] && std::isfinite(*x[n])) out[n] = scale > 0 ? (*x[n] - middle) / scale : 0;
  return out;
}

std::vector<Entry> collect(const std::vector<Case>& cases, const std::string& folder) {
  std::vector<Entry> out;
  for (const Case& row : cases) {
    std::vector<Entry> entries;
    try {
      entries = entries_of(row, folder);
    } catch (const surf::InputError&) {  // damaged: as if it had not been run
    }
    if (entries.empty()) entries.push_back(not_run(row));
    std::move(entries.begin(), entries.end(), std::back_inserter(out));
  }
  compare(out);
  std::stable_sort(out.begin(), out.end(), [](const Entry& a, const Entry& b) {
    if (rank(a) != rank(b)) return rank(a) < rank(b);
    return rank(a) == 1 && greatest_z(a) > greatest_z(b);
  });
  return out;
}

}  // namespace surfseg::batch
