#include "libsurf/io/detail/threemf_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/io/detail/colour.h"
#include "libsurf/io/detail/numbers.h"
#include "libsurf/io/detail/zip_file.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/measure.h"

namespace surf::io {
namespace {

constexpr const char* kContentTypes =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
    "<Default Extension=\"rels\" "
    "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
    "<Default Extension=\"model\" "
    "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";
constexpr const char* kRelations =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";

bool is_closed(const Triangles& surface) {
  const auto components = mesh::measure_components(surface);
  return std::all_of(components.begin(), components.end(),
                     [](const mesh::ComponentMeasures& c) { return c.n_border_edges == 0; });
}

/// The part of each triangle: its solid. All of them are part 0 where the surface has not just
/// solids, as an open one.
std::vector<int> parts_of(const Triangles& surface) {
  std::vector<int> whole(std::size_t(surface.elements.rows()), 0);
  if (!is_closed(surface)) return whole;
  const mesh::ShellHierarchy hierarchy = mesh::shell_hierarchy(surface);
  std::vector<int> part(hierarchy.shells.size(), -1);
  int n = 0;
  for (const mesh::Solid& solid : mesh::solids(hierarchy)) {
    part[std::size_t(solid.outer)] = n;
    for (const int cavity : solid.cavities) part[std::size_t(cavity)] = n;
    ++n;
  }
  if (std::find(part.begin(), part.end(), -1) != part.end()) return whole;
  std::vector<int> out;
  for (const int shell : hierarchy.of_triangle) out.push_back(part[std::size_t(shell)]);
  return out;
}

/// `<mesh>` of the triangles of one part, with the points that they use in their order.
std::string mesh_of(const Triangles& surface, const std::vector<int>& parts, int part) {
  std::vector<int> number(std::size_t(surface.points.rows()), -1);
  for (Eigen::Index t = 0; t < surface.elements.rows(); ++t)
    if (parts[std::size_t(t)] == part)
      for (const int vertex : surface.elements.row(t)) number[std::size_t(vertex)] = 0;
  std::string out = "<mesh><vertices>\n";
  int n = 0;
  for (Eigen::Index i = 0; i < surface.points.rows(); ++i) {
    if (number[std::size_t(i)] < 0) continue;
    number[std::size_t(i)] = n++;
    for (int axis = 0; axis < 3; ++axis) {
      out += axis == 0 ? "<vertex x=\"" : axis == 1 ? "\" y=\"" : "\" z=\"";
      append_number(out, surface.points(i, axis));
    }
    out += "\"/>\n";
  }
  out += "</vertices><triangles>\n";
  for (Eigen::Index t = 0; t < surface.elements.rows(); ++t) {
    if (parts[std::size_t(t)] != part) continue;
    const auto e = surface.elements.row(t);
    out += fmt::format("<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"/>\n", number[std::size_t(e[0])],
                       number[std::size_t(e[1])], number[std::size_t(e[2])]);
  }
  return out + "</triangles></mesh>";
}

}  // namespace

std::string threemf_bytes(const Triangles& surface, const WriteOptions& options) {
  const std::vector<int> parts = parts_of(surface);
  const int n_parts = parts.empty() ? 0 : 1 + *std::max_element(parts.begin(), parts.end());
  const std::string name = xml_text(options.name.empty() ? "surface" : options.name);
  const auto colour = options.colour.value_or(kBone);
  std::string model = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<model unit=\"millimeter\" xml:lang=\"en-US\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n"
      "<metadata name=\"Application\">surfseg</metadata>\n"
      "<metadata name=\"Description\">SPACE={}</metadata>\n<resources>\n"
      "<basematerials id=\"1\"><base name=\"{}\" displaycolor=\"#{:02X}{:02X}{:02X}\"/>"
      "</basematerials>\n",
      surf::io::name(options.space), name, colour[0], colour[1], colour[2]);
  std::string items;
  for (int part = 0; part < n_parts; ++part) {
    const std::string numbered = n_parts == 1 ? name : fmt::format("{} {}", name, part + 1);
    model += fmt::format("<object id=\"{}\" type=\"model\" pid=\"1\" pindex=\"0\" name=\"{}\">",
                         part + 2, numbered) +
             mesh_of(surface, parts, part) + "</object>\n";
    items += fmt::format("<item objectid=\"{}\"/>\n", part + 2);
  }
  model += "</resources>\n<build>\n" + items + "</build>\n</model>\n";
  return zip_file({{"[Content_Types].xml", kContentTypes},
                   {"_rels/.rels", kRelations},
                   {"3D/3dmodel.model", model}});
}

}  // namespace surf::io
