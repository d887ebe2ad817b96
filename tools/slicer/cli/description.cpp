#include "tools/slicer/cli/description.h"

#include <fmt/format.h>

#include "libsurf/base/escaped.h"

namespace surfseg::slicer {
namespace {

constexpr int kIndexOfGivenBack = 1000;  // CTK's mark of them

std::string element_of(Kind kind) {
  switch (kind) {
    case Kind::kVolume:
    case Kind::kLabels:
      return "image";
    case Kind::kPoints:
      return "point";
    case Kind::kPointFile:
      return "file";
    case Kind::kSurface:
      return "geometry";
    case Kind::kText:
    case Kind::kGivenText:
      return "string";
    case Kind::kNumber:
    case Kind::kGivenNumber:
      return "double";
    case Kind::kChoice:
      return "string-enumeration";
    case Kind::kFlag:
      return "boolean";
  }
  return "";
}

/// Slicer names a file by the first ending.
std::string attributes_of(Kind kind) {
  switch (kind) {
    case Kind::kPoints:
      return R"( multiple="true" coordinateSystem="lps")";
    case Kind::kPointFile:
      return R"( fileExtensions=".mrk.json,.fcsv")";
    case Kind::kSurface:
      return R"( fileExtensions=".vtp,.stl,.ply,.obj")";
    case Kind::kLabels:
      return R"( type="label" fileExtensions=".nrrd,.nii.gz,.nii,.mha")";
    case Kind::kVolume:
      return R"( fileExtensions=".nrrd,.nii.gz,.nii,.mha")";
    default:
      return "";
  }
}

bool is_output(const Parameter& parameter) {
  return parameter.kind == Kind::kSurface || parameter.kind == Kind::kLabels ||
         is_given_back(parameter);
}

std::string line(int depth, const std::string& name, const std::string& text) {
  return fmt::format("{:{}}<{}>{}</{}>\n", "", 2 * depth, name, xml_text(text), name);
}

/// How it is passed.
std::string passing(const Parameter& parameter, Dialect dialect) {
  if (parameter.kind == Kind::kVolume) return line(3, "index", "0");
  if (!is_given_back(parameter)) return line(3, "longflag", flag_of(parameter));
  return dialect == Dialect::kCtk ? line(3, "index", std::to_string(kIndexOfGivenBack)) : "";
}

std::string text_of(const Parameter& parameter, Dialect dialect) {
  const std::string element = element_of(parameter.kind);
  std::string out = fmt::format("    <{}{}>\n", element, attributes_of(parameter.kind));
  out += line(3, "name", parameter.name) + passing(parameter, dialect);
  out += line(3, "description", parameter.description) + line(3, "label", parameter.label);
  if (!parameter.standard.empty()) out += line(3, "default", parameter.standard);
  out += line(3, "channel", is_output(parameter) ? "output" : "input");
  if (parameter.kind == Kind::kNumber)
    out += "      <constraints>\n" + line(4, "minimum", "0") + line(4, "maximum", "1000000") +
           line(4, "step", "1") + "      </constraints>\n";
  for (const std::string& choice : parameter.choices) out += line(3, "element", choice);
  return out + fmt::format("    </{}>\n", element);
}

std::string text_of(const Group& group, Dialect dialect) {
  std::string out = group.is_advanced ? "  <parameters advanced=\"true\">\n" : "  <parameters>\n";
  out += line(2, "label", group.label) + line(2, "description", group.description);
  for (const Parameter& parameter : group.parameters) out += text_of(parameter, dialect);
  return out + "  </parameters>\n";
}

}  // namespace

std::string xml_text(const std::string& text) {
  return surf::escaped(text, {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}});
}

std::string description(const std::vector<Group>& groups, const std::string& version,
                        Dialect dialect) {
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<executable>\n";
  out += line(1, "category", "Segmentation") + line(1, "title", "Surface from points (surfseg)");
  out += line(1, "description",
              "The closed surface of the object that the points inside lie in, with sub-voxel "
              "accuracy. Where it goes too far, a point outside takes that off.");
  out += line(1, "version", version) + line(1, "license", "GPL-3.0-or-later");
  for (const Group& group : groups) out += text_of(group, dialect);
  return out + "</executable>\n";
}

}  // namespace surfseg::slicer
