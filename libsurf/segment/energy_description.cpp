#include "libsurf/segment/energy_description.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "libsurf/segment/energy_kind.h"

namespace surf::segment {
namespace {

using nlohmann::ordered_json;

/// "gamma0      weight of the area [mm]; > 0; default 1"
template <int Dim>
std::string line_of(const KindParameter<Dim>& parameter) {
  return fmt::format("    {:<15} {} [{}]; {}; default: {}\n", parameter.key, parameter.meaning,
                     parameter.unit, parameter.range.text(), parameter.standard.text);
}

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json to_json(const ParameterRange& range) {
  ordered_json out = {{"text", range.text()}};
  if (!range.values.empty()) {
    out["values"] = range.values;
    return out;
  }
  out["lowest"] = number(range.lowest);
  out["highest"] = number(range.highest);
  out["excludes_lowest"] = range.excludes_lowest;
  return out;
}

template <int Dim>
ordered_json to_json(const KindParameter<Dim>& parameter) {
  const ParameterDefault<Dim>& standard = parameter.standard;
  return {{"key", parameter.key},
          {"unit", parameter.unit},
          {"meaning", parameter.meaning},
          {"range", to_json(parameter.range)},
          {"default", standard.constant ? ordered_json(*standard.constant) : ordered_json(nullptr)},
          {"default_text", standard.text},
          {"is_optional", standard.is_absent()},
          {"blur_power", parameter.blur_power}};
}

template <int Dim>
ordered_json to_json(const EnergyKind<Dim>& kind) {
  ordered_json out = {{"name", kind.name},
                      {"formula", kind.formula},
                      {"description", kind.description},
                      {"settles_on_edges", kind.settles_on_edges},
                      {"denoises", bool(kind.piecewise_smooth)},
                      {"parameters", ordered_json::array()}};
  for (const auto& parameter : kind.parameters) out["parameters"].push_back(to_json(parameter));
  return out;
}

/// A row of the table; what is there in one dimension only, or differs, says so.
struct Row {
  std::string kind, key, meaning, unit, range, in_volumes, in_images;

  std::string text() const {
    const auto only = [](const std::string& which, const std::string& what) {
      return fmt::format("{} ({} only)", what, which);
    };
    const std::string standard = in_images.empty()         ? only("volumes", in_volumes)
                                 : in_volumes.empty()      ? only("images", in_images)
                                 : in_volumes == in_images ? in_volumes
                                                           : in_volumes + "; " + in_images;
    return fmt::format("| `{}` | `{}` | {} | {} | {} | {} |\n", kind, key, escaped(meaning), unit,
                       range, escaped(standard));
  }

  static std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '|' ? "\\|" : std::string(1, c);
    return out;
  }
};

template <int Dim>
void add_rows(std::vector<Row>& rows) {
  for (const EnergyKind<Dim>* kind : all_kinds<Dim>())
    for (const KindParameter<Dim>& p : kind->parameters) {
      auto row = rows.begin(), end_of_kind = rows.end();
      for (; row != rows.end() && !(row->kind == kind->name && row->key == p.key); ++row)
        if (row->kind == kind->name) end_of_kind = row + 1;
      if (row == rows.end())
        row = rows.insert(end_of_kind,
                          {kind->name, p.key, p.meaning, p.unit, p.range.text(), {}, {}});
      (Dim == 3 ? row->in_volumes : row->in_images) = p.standard.text;
    }
}

}  // namespace

template <int Dim>
std::string describe_energies() {
  std::string out;
  for (const EnergyKind<Dim>* kind : all_kinds<Dim>()) {
    out += fmt::format("{}\n    {}\n    {}\n", kind->name, kind->formula, kind->description);
    for (const auto& parameter : kind->parameters) out += line_of(parameter);
    out += '\n';
  }
  out +=
      "A term is NAME:key=value,...,weight=w; the weight is 1 unless given, and what is not given "
      "has its default.\n";
  if (Dim == 2) out += "Areas and volumes are lengths and areas here.\n";
  return out;
}

template <int Dim>
std::string energies_as_json() {
  ordered_json out = ordered_json::array();
  for (const EnergyKind<Dim>* kind : all_kinds<Dim>()) out.push_back(to_json(*kind));
  return out.dump(2);
}

std::string parameters_as_markdown() {
  std::vector<Row> rows;
  add_rows<3>(rows);
  add_rows<2>(rows);
  std::string out =
      "| energy | parameter | what it is | unit | range | default |\n|---|---|---|---|---|---|\n";
  for (const Row& row : rows) out += row.text();
  return out;
}

template std::string describe_energies<2>();
template std::string describe_energies<3>();
template std::string energies_as_json<2>();
template std::string energies_as_json<3>();

}  // namespace surf::segment
