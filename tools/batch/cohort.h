// All cases of a batch side by side: how each went, and which differ from the others.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/batch/case_list.h"

namespace surfseg::batch {

enum class State { kFailed, kAtLimit, kDone, kNotRun };
/// "failed", "stopped at a limit", "done", "not run"
std::string to_string(State state);

/// A number that cases are compared by.
struct Metric {
  const char* key;
  const char* title;
  const char* unit;         ///< "" = none
  const char* description;  ///< one sentence
  bool is_for_outliers;     ///< |z| of it says that a case is one
};
inline constexpr std::array<Metric, 8> kMetrics = {
    {{"volume_ml", "Volume", "ml", "Volume that the surface encloses", true},
     {"area_cm2", "Area", "cm²", "Area of the surface", true},
     {"triangles", "Triangles", "", "Triangles of the surface", true},
     {"sphericity", "Sphericity", "", "Area of the ball of equal volume by that of the surface",
      true},
     {"share_without_edge", "Share without edge", "",
      "Share of the area where no edge was found in the image", true},
     {"likelihood", "Likelihood", "", "Of being right, as the verdict has it", true},
     {"border_share", "Share on the border", "", "Share of the area on the volume's border", false},
     {"dice", "Dice", "", "Overlap with the reference", false}}};
constexpr std::size_t kNMetrics = kMetrics.size();

/// Where |z| exceeds it a case is an outlier (Iglewicz and Hoaglin).
constexpr double kOutlierZ = 3.5;

/// An object of a case.
struct Entry {
  std::string name, object;  ///< no object = the only one
  State state = State::kNotRun;
  int exit_code = 0;
  std::string message;  ///< why there is nothing, or how the flow ended
  std::string verdict;  ///< "trusted", "check", "doubtful"
  std::array<std::optional<double>, kNMetrics> values, z;
  std::vector<std::string> outlier_in;  ///< keys of metrics
  std::string scan;
  std::vector<std::string> files;  ///< relative to the folder
};

/// Robust z = (x - median) / max(MAD / 0.6745, distance of the quartiles / 1.349): the second where
/// the values are of two kinds, of which neither is an outlier. Where more than half of the values
/// are the same, (x - median) / (1.2533 mean |x - median|). Nothing where x is missing, or for
/// fewer than five values.
std::vector<std::optional<double>> robust_z(const std::vector<std::optional<double>>& x);

/// What the summaries of these cases say: failures first, then outliers, farthest first, then what
/// was stopped at a limit, the others, and what was not run; else in the order of the list.
std::vector<Entry> collect(const std::vector<Case>& cases, const std::string& folder);

/// Writes group.tsv, with what its columns mean in group.json, and group.html.
/// @throws surf::OutputError
void write_group(const std::vector<Entry>& entries, const std::string& folder);

/// The page: everything in one file but for pictures.
std::string group_page(const std::vector<Entry>& entries);

}  // namespace surfseg::batch
