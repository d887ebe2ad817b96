#include "tools/report/sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "tools/common/html.h"

namespace surfseg::report {
namespace {

using nlohmann::ordered_json;

/// A table of names and values; pieces without a value are left out.
class Rows {
 public:
  explicit Rows(const std::string& title) : title_(title) {}
  void add(const std::string& name, const std::string& value) {
    rows_ += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", html_text(name),
                         html_text(value));
  }
  /// A number of an entry, as it is in the summary to six digits.
  void add(const std::string& name, const ordered_json& entry, const char* key,
           const std::string& unit = {}, double factor = 1) {
    if (!entry.is_object() || !entry.contains(key) || !entry[key].is_number()) return;
    add(name, fmt::format("{:.6g}{}{}", factor * entry[key].get<double>(), unit.empty() ? "" : " ",
                          unit));
  }
  std::string html(const std::string& foot = {}) const {
    if (rows_.empty()) return "";
    return fmt::format("<div class=\"block\"><h3>{}</h3><table>\n{}</table>{}</div>\n", title_,
                       rows_, foot.empty() ? "" : "<p class=\"soft\">" + html_text(foot) + "</p>");
  }

 private:
  std::string title_, rows_;
};

const ordered_json& part(const ordered_json& json, const char* key) {
  static const ordered_json none = ordered_json::object();
  return json.is_object() && json.contains(key) ? json[key] : none;
}

std::string text(const ordered_json& json, const char* key) {
  return json.is_object() && json.contains(key) && json[key].is_string()
             ? json[key].get<std::string>()
             : "";
}

std::string point_text(const ordered_json& point, const char* format = "{:.2f}") {
  std::string out;
  for (const auto& x : point)
    out += (out.empty() ? "" : ", ") + fmt::format(fmt::runtime(format), x.get<double>());
  return out;
}

std::string point_text(const surf::Vector<3>& p) {
  return fmt::format("{:.2f}, {:.2f}, {:.2f}", p[0], p[1], p[2]);
}

std::string size_block(const ordered_json& entry) {
  Rows rows("Size and form");
  rows.add("Volume", entry, "volume_mm3", "ml", 1e-3);
  rows.add("Volume, standard deviation", part(entry, "certainty"), "volume_deviation_mm3", "ml",
           1e-3);
  rows.add("Area", entry, "area_mm2", "cm²", 1e-2);
  const ordered_json& form = part(entry, "form");
  rows.add("Sphericity", form, "sphericity");
  rows.add("Feret diameter, largest", form, "feret_largest_mm", "mm");
  rows.add("Feret diameter, smallest", form, "feret_smallest_mm", "mm");
  if (entry.contains("centroid_ras_mm"))
    rows.add("Centroid (RAS mm)", point_text(entry["centroid_ras_mm"]));
  if (form.contains("semi_axes_mm")) {
    for (int k = 0; k < 3; ++k)
      rows.add(fmt::format("Principal semi-axis {}", k + 1),
               fmt::format("{:.6g} mm along {}", form["semi_axes_mm"][k].get<double>(),
                           point_text(form["axes_ras"][k], "{:.3f}")));
    rows.add("Elongation, flatness", fmt::format("{:.4g}, {:.4g}", form["elongation"].get<double>(),
                                                 form["flatness"].get<double>()));
  }
  return rows.html(
      "Volume and area are those of the surface. Sphericity: area of the ball of equal volume by "
      "the surface's. Feret diameters: of the convex hull, exact. Semi-axes: of the ellipsoid with "
      "the same second moments; elongation: first by second, flatness: second by third.");
}

std::string intensities_block(const ordered_json& intensities) {
  if (intensities.empty()) return "";
  Rows rows("Intensities");
  for (const auto& [key, where] : {std::pair{"inside", std::string("Inside")},
                                   {"shell", fmt::format("In a shell of {:.3g} mm around",
                                                         intensities["shell_mm"].get<double>())}}) {
    const ordered_json& of = intensities[key];
    rows.add(where + ": voxels", of, "voxels");
    rows.add(where + ": mean", of, "mean");
    rows.add(where + ": standard deviation", of, "standard_deviation");
    rows.add(where + ": median", of, "median");
    if (of.contains("percentile_5"))
      rows.add(where + ": 5 to 95 %",
               fmt::format("{:.6g} to {:.6g}", of["percentile_5"].get<double>(),
                           of["percentile_95"].get<double>()));
  }
  return rows.html("Values of the voxels whose centres lie there, as the file has them.");
}

std::string reference_block(const ordered_json& reference) {
  if (reference.empty()) return "";
  Rows rows("Distance to the reference");
  rows.add("Reference", text(reference, "file"));
  rows.add("Label", reference, "label");
  if (reference.contains("not_compared")) rows.add("Not compared", text(reference, "not_compared"));
  rows.add("Dice", reference, "dice");
  rows.add("Jaccard", reference, "jaccard");
  rows.add("Volume of the reference", reference, "reference_volume_mm3", "ml", 1e-3);
  rows.add("Difference of the volumes", reference, "volume_difference_percent", "%");
  const ordered_json& distance = part(reference, "distance");
  rows.add("Mean distance", distance, "mean_mm", "mm");
  rows.add("RMS distance", distance, "rms_mm", "mm");
  rows.add("95 % distance", distance, "p95_mm", "mm");
  rows.add("Hausdorff distance", distance, "max_mm", "mm");
  return rows.html("As surfseg evaluate gives them.");
}

std::string certainty_block(const ordered_json& entry) {
  const ordered_json& certainty = part(entry, "certainty");
  Rows rows("Confidence");
  rows.add("Likelihood of being right", part(entry, "verdict"), "likelihood");
  rows.add("Place of a vertex, deviation: median", part(certainty, "deviation_mm"), "median", "mm");
  rows.add("Place of a vertex, deviation: 95 %", part(certainty, "deviation_mm"), "percentile_95",
           "mm");
  rows.add("Strength of the edge: median", part(certainty, "edge_strength"), "median");
  rows.add("Area without an edge", certainty, "share_without_edge", "%", 100);
  if (certainty.contains("next_click_ras_mm"))
    rows.add("Next click, where it tells most (RAS mm)",
             point_text(certainty["next_click_ras_mm"]));
  if (const ordered_json& verdict = part(entry, "verdict"); verdict.contains("place_ras_mm"))
    rows.add("Where to look (RAS mm)", point_text(verdict["place_ras_mm"]));
  return rows.html(
      certainty.empty()
          ? "Nothing is known of single places: the vertices were not located on edges, or the "
            "object was cut at the wall of another one."
          : "In 95 of 100 vertices with an edge twice the deviation holds it; the strength is the "
            "height of the step by the deviation of the noise. The viewer shows both.");
}

std::string mesh_block(const ordered_json& entry, const surf::segment::Measures<3>& measures) {
  constexpr std::size_t kMostShells = 40;
  Rows rows("Topology and mesh");
  rows.add("Checks", measures.verdict);
  rows.add("Components of the boundary", entry, "components");
  std::size_t n = 0;
  for (const auto& component : measures.components) {
    if (++n > kMostShells) break;
    rows.add(fmt::format("Component {}", n),
             fmt::format("{:.6g} ml, genus {} (Euler characteristic {}), {} cavities",
                         component.content / 1000, component.genus, 2 - 2 * component.genus,
                         component.cavities.size()));
  }
  if (measures.components.size() > kMostShells)
    rows.add("Further components", std::to_string(measures.components.size() - kMostShells));
  rows.add("Triangles", entry, "triangles");
  rows.add("Vertices", entry, "vertices");
  rows.add("Smallest angle", entry, "min_angle_deg", "°");
  rows.add("Triangles with all angles of 25° or more", entry, "share_above_25_deg", "%", 100);
  return rows.html();
}

std::string clicks_table(const ReportedObject<3>& object, const surf::volume::Volume& volume) {
  constexpr std::size_t kMostClicks = 100;
  const auto& clicks = object.object->clicks;
  std::string out =
      "<h3>Clicks</h3><table class=\"wide\"><tr><th>side</th><th>RAS (mm)</th><th>voxel</th>"
      "<th>value</th><th></th></tr>\n";
  for (std::size_t n = 0; n < std::min(clicks.size(), kMostClicks); ++n) {
    const surf::Vector<3> at = volume.world_to_index() * clicks[n].point_mm;
    std::array<int, 3> voxel;
    for (int axis = 0; axis < 3; ++axis)
      voxel[axis] = std::clamp(int(std::lround(at[axis])), 0, volume.size()[axis] - 1);
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}, {}, {}</td><td>{:.6g}</td><td>{}</td></tr>\n",
        clicks[n].side == surf::segment::Side::kInside ? "inside" : "outside",
        point_text(clicks[n].point_mm), voxel[0], voxel[1], voxel[2],
        volume.value(voxel[0], voxel[1], voxel[2]),
        clicks[n].stroke_mm.empty()
            ? ""
            : fmt::format("a stroke with {} more points", clicks[n].stroke_mm.size()));
  }
  out += "</table>\n";
  if (clicks.size() > kMostClicks)
    out += fmt::format("<p>and {} more</p>\n", clicks.size() - kMostClicks);
  return clicks.empty() ? "" : out;
}

std::string list(const char* title, const ordered_json& texts) {
  if (texts.empty()) return "";
  std::string out = fmt::format("<h3>{}</h3><ul>\n", title);
  for (const auto& one : texts)
    out += fmt::format("<li><code>{}</code></li>\n", html_text(one.get<std::string>()));
  return out + "</ul>\n";
}

std::string proposals_table(const ordered_json& proposals) {
  constexpr std::size_t kMost = 8;
  if (proposals.empty()) return "";
  std::string out =
      "<h3>Proposals</h3><table class=\"wide\"><tr><th></th><th>score</th><th>volume (ml)</th>"
      "<th>intensities</th></tr>\n";
  for (std::size_t n = 0; n < std::min(proposals.size(), kMost); ++n)
    out += fmt::format(
        "<tr><td>{}</td><td>{:.4g}</td><td>{:.4g}</td><td>{:.5g} ± {:.4g}</td></tr>\n", n + 1,
        proposals[n]["score"].get<double>(), proposals[n]["volume_mm3"].get<double>() / 1000,
        proposals[n]["mean"].get<double>(), proposals[n]["half_width"].get<double>());
  return out + "</table>\n";
}

/// What earlier objects have of it; verdict and border are those of the whole.
std::vector<std::string> walls_of(const ordered_json& entry) {
  std::vector<std::string> out;
  for (const ordered_json& wall : part(entry, "walls"))
    out.push_back(fmt::format(
        "{:.4g} ml that {} has too went, which comes before it; {:.4g} cm² of its wall is theirs",
        wall["removed_mm3"].get<double>() / 1000, text(wall, "with"),
        wall["area_mm2"].get<double>() / 100));
  return out;
}

}  // namespace

std::string file_name(const std::string& path) {
  const std::filesystem::path named(path);
  return (named.has_filename() ? named : named.parent_path()).filename().string();
}

std::string name_of(const ReportedObject<3>& object) {
  return object.object->name.empty() ? "The surface" : object.object->name;
}

std::string trust_of(const ReportedObject<3>& object) {
  if (!object.finished) return "failed";
  const auto& verdict = object.object->result->verdict;
  return verdict ? to_string(verdict->trust) : "none";
}

std::string verdict_section(const ReportedObject<3>& object) {
  const auto& result = *object.object->result;
  const bool has_failed = !object.finished;
  const std::string why = text(object.entry, "not_written");
  std::string words = has_failed ? "no surface: " + (why.empty() ? result.message : why)
                      : result.verdict
                          ? result.verdict->text()
                          : "no verdict: such ways of segmenting have not been measured; look at "
                            "the pictures";
  std::string out = fmt::format("<p class=\"verdict {}\"><b>{}</b> {}</p>\n", trust_of(object),
                                html_text(name_of(object)), html_text(words));
  out += "<ul class=\"checks\">\n";
  const auto line = [&](bool is_good, const std::string& what) {
    out += fmt::format("<li class=\"{}\">{}</li>\n", is_good ? "good" : "bad", html_text(what));
  };
  if (!has_failed) line(object.finished->measures.passed, object.finished->measures.verdict);
  line(surf::segment::exit_code(result.outcome) == 0,
       fmt::format("{}: {}", to_string(result.outcome), result.message));
  if (!has_failed)
    line(
        result.border_share == 0,
        result.border_share > 0
            ? fmt::format("the volume ends before the object does: {:.3g} % of the surface lies on "
                          "the volume's border",
                          100 * result.border_share)
            : "does not touch the border of the volume");
  if (!has_failed)
    for (const std::string& wall : walls_of(object.entry)) line(false, wall);
  for (const std::string& note : result.notes) line(false, note);
  return out + "</ul>\n";
}

std::string number_sections(const ReportedObject<3>& object) {
  if (!object.finished) return "";
  return "<div class=\"blocks\">\n" + size_block(object.entry) +
         intensities_block(part(object.entry, "intensities")) +
         reference_block(part(object.entry, "reference")) + certainty_block(object.entry) +
         mesh_block(object.entry, object.finished->measures) + "</div>\n";
}

std::string making_section(const ReportedObject<3>& object, const Case& of) {
  const ordered_json& chosen = part(object.entry, "chosen");
  Rows lengths("Lengths");
  lengths.add("Blur (sigma)", chosen, "sigma_mm", "mm");
  lengths.add("Finest edges", chosen, "edge_length_mm", "mm");
  lengths.add("Geometry tolerance", chosen, "geometry_tolerance_mm", "mm");
  lengths.add("Steps", object.entry, "iterations");
  lengths.add("Energy at the end", object.entry, "energy");
  return fmt::format("<details><summary>How it was made</summary>\n{}{}{}{}</details>\n",
                     clicks_table(object, of.volume), list("Energy", part(chosen, "energies")),
                     lengths.html(), proposals_table(part(object.entry, "proposals")));
}

std::string input_section(const Case& of) {
  const auto& volume = of.volume;
  const auto& source = volume.source();
  Rows rows("The volume");
  rows.add("File", file_name(source.path));
  rows.add("Format", fmt::format("{}, {}", source.format, source.scalar_type));
  rows.add("Voxels",
           fmt::format("{} x {} x {}", volume.size()[0], volume.size()[1], volume.size()[2]));
  const auto spacing = volume.spacing();
  rows.add("Spacing",
           fmt::format("{:.6g} x {:.6g} x {:.6g} mm", spacing[0], spacing[1], spacing[2]));
  rows.add("Affine from", source.orientation_source);
  for (int row = 0; row < 3; ++row) {
    const auto& m = volume.index_to_world().matrix();
    rows.add(
        fmt::format("Affine to {}", "RAS"[row]),
        fmt::format("{:.6g}, {:.6g}, {:.6g}, {:.6g}", m(row, 0), m(row, 1), m(row, 2), m(row, 3)));
  }
  rows.add("SHA-1 of size, affine and values", of.volume_hash);
  for (const std::string& note : source.notes) rows.add("Note", note);
  return fmt::format(
      "<section><h2>Input and command</h2>\n{}<h3>Command line</h3><pre>{}</pre>\n"
      "<p>surfseg {}; exit code {}</p></section>\n",
      rows.html(), html_text(of.command_line), SURFSEG_VERSION, of.exit_code);
}

std::string methods_section(const Case& of) {
  std::string text =
      fmt::format("Surfaces were segmented with surfseg {} in a volume of {} x {} x {} voxels.",
                  SURFSEG_VERSION, of.volume.size()[0], of.volume.size()[1], of.volume.size()[2]);
  for (const auto& object : of.objects) {
    const auto& clicks = object.object->clicks;
    const auto n_inside = std::count_if(clicks.begin(), clicks.end(), [](const auto& click) {
      return click.side == surf::segment::Side::kInside;
    });
    if (!object.finished) {
      text += fmt::format(" {}: no surface came about.", name_of(object));
      continue;
    }
    const auto& result = *object.object->result;
    std::string energies;
    for (const auto& term : result.energies)
      energies += (energies.empty() ? "" : " + ") + to_string(term);
    text += fmt::format(" {}: from {} inside and {} outside click{}", name_of(object), n_inside,
                        clicks.size() - std::size_t(n_inside), clicks.size() == 1 ? "" : "s");
    if (result.search) text += " a search of regions proposed a start, from which";
    text += fmt::format(" a triangle surface evolved to a minimum of the shape energy {} ({}).",
                        energies.empty() ? "of the chosen region" : energies,
                        to_string(result.outcome));
    if (object.finished->certainty)
      text += " Its vertices were then located on the edges of the image by fits of blurred steps.";
    text += fmt::format(
        " The result has {} triangles, is closed, manifold and free of self-intersections, and "
        "encloses {:.5g} ml.",
        object.finished->measures.n_elements, object.finished->measures.content / 1000);
  }
  return fmt::format(
      "<section><h2>Methods text and citation</h2>\n<p id=\"methods\">{}</p>\n"
      "<p>Please cite: G. Dogan. A Variational Shape Optimization Framework for Image "
      "Segmentation. PhD thesis, University of Maryland, College Park, 2006.</p></section>\n",
      html_text(text));
}

}  // namespace surfseg::report
