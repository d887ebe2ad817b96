#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "libsurf/base/file.h"
#include "tools/batch/cohort.h"
#include "tools/batch/page.h"
#include "tools/batch/table.h"
#include "tools/common/html.h"
#include "tools/common/report.h"

namespace surfseg::batch {
namespace {

using nlohmann::ordered_json;

std::string number(const std::optional<double>& value, const char* format) {
  return value ? fmt::format(fmt::runtime(format), *value) : "n/a";
}

std::string group_table(const std::vector<Entry>& entries) {
  std::vector<std::string> header = {"name", "object", "state", "exit_code", "verdict", "outlier"};
  for (const Metric& metric : kMetrics) header.emplace_back(metric.key);
  for (const Metric& metric : kMetrics)
    if (metric.is_for_outliers) header.push_back(fmt::format("z_{}", metric.key));
  header.insert(header.end(), {"scan", "message"});
  std::string out = fmt::format("{}\n", fmt::join(header, "\t"));
  for (const Entry& entry : entries) {
    const bool has_run = entry.state != State::kNotRun;
    std::vector<std::string> cells = {entry.name,
                                      cell(entry.object),
                                      to_string(entry.state),
                                      has_run ? std::to_string(entry.exit_code) : "n/a",
                                      cell(entry.verdict),
                                      cell(fmt::format("{}", fmt::join(entry.outlier_in, ",")))};
    for (const auto& value : entry.values) cells.push_back(number(value, "{:.6g}"));
    for (std::size_t m = 0; m < kNMetrics; ++m)
      if (kMetrics[m].is_for_outliers) cells.push_back(number(entry.z[m], "{:.2f}"));
    cells.insert(cells.end(), {cell(entry.scan), cell(entry.message)});
    out += fmt::format("{}\n", fmt::join(cells, "\t"));
  }
  return out;
}

/// What the columns of the table mean, as BIDS has it beside a table.
ordered_json columns() {
  ordered_json out = {{"name", {{"Description", "The case: files begin with sub-NAME"}}},
                      {"object", {{"Description", "The object, where a case has several"}}},
                      {"state", {{"Description", "done, stopped at a limit, failed or not run"}}},
                      {"exit_code", {{"Description", "What surfseg segment ends with"}}},
                      {"verdict", {{"Description", "How far the answer is to be trusted"}}},
                      {"outlier", {{"Description", "Columns in which the robust z exceeds 3.5"}}}};
  for (const Metric& metric : kMetrics) {
    out[metric.key] = {{"Description", metric.description}};
    if (*metric.unit != '\0') out[metric.key]["Units"] = metric.unit;
  }
  for (const Metric& metric : kMetrics)
    if (metric.is_for_outliers)
      out[fmt::format("z_{}", metric.key)] = {
          {"Description",
           "Robust z among objects of the same name: (x - median) / max(MAD / 0.6745, distance of "
           "the quartiles / 1.349); where MAD is 0, (x - median) / (1.2533 mean |x - median|)"}};
  out["scan"] = {{"Description", "As the list names it"}};
  out["message"] = {{"Description", "Why it failed, or how the flow ended"}};
  return out;
}

ordered_json json_of(const std::optional<double>& value, int digits) {
  if (!value || !std::isfinite(*value)) return nullptr;
  return ordered_json::parse(fmt::format("{:.{}g}", *value, digits));
}

/// What the page shows.
ordered_json data_of(const std::vector<Entry>& entries) {
  ordered_json metrics = ordered_json::array(), rows = ordered_json::array();
  for (const Metric& metric : kMetrics)
    metrics.push_back({{"key", metric.key},
                       {"title", metric.title},
                       {"unit", metric.unit},
                       {"about", metric.description},
                       {"judged", metric.is_for_outliers}});
  for (const Entry& entry : entries) {
    ordered_json x = ordered_json::array(), z = ordered_json::array();
    for (std::size_t m = 0; m < kNMetrics; ++m) {
      x.push_back(json_of(entry.values[m], 6));
      z.push_back(json_of(entry.z[m], 3));
    }
    rows.push_back({{"name", entry.name},
                    {"object", entry.object},
                    {"state", to_string(entry.state)},
                    {"code", entry.exit_code},
                    {"message", entry.message},
                    {"verdict", entry.verdict},
                    {"outlier", entry.outlier_in},
                    {"scan", entry.scan},
                    {"files", entry.files},
                    {"x", std::move(x)},
                    {"z", std::move(z)}});
  }
  return {{"metrics", metrics}, {"rows", rows}, {"limit", kOutlierZ}};
}

/// For browsers without scripts, and for those who read the file itself.
std::string plain_rows(const std::vector<Entry>& entries) {
  std::string out;
  for (const Entry& entry : entries)
    out += fmt::format("<li>{}{}{}: {}{}</li>\n", html_text(entry.name),
                       entry.object.empty() ? "" : " ", html_text(entry.object),
                       entry.outlier_in.empty()
                           ? to_string(entry.state)
                           : fmt::format("outlier in {}", fmt::join(entry.outlier_in, ", ")),
                       entry.state == State::kFailed ? ": " + html_text(entry.message) : "");
  return out;
}

}  // namespace

std::string group_page(const std::vector<Entry>& entries) {
  std::string page(page_files().html);
  put(page, "/*style*/", std::string(page_files().style));
  put(page, "<!--rows-->", plain_rows(entries));
  put(page, "{/*data*/}",
      json_in_script(
          data_of(entries).dump(-1, ' ', false, ordered_json::error_handler_t::replace)));
  put(page, "/*script*/", std::string(page_files().script));
  return page;
}

void write_group(const std::vector<Entry>& entries, const std::string& folder) {
  surf::write_bytes(folder + "/group.tsv", group_table(entries));
  write_json(folder + "/group.json", columns());
  surf::write_bytes(folder + "/group.html", group_page(entries));
}

}  // namespace surfseg::batch
