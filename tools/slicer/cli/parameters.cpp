#include "tools/slicer/cli/parameters.h"

#include "libsurf/segment/presets.h"

namespace surfseg::slicer {
namespace {

constexpr const char* kNone = "none";

Group volume_and_points() {
  return {"Volume and points",
          "What to segment, and what is inside and outside of it",
          false,
          {{Kind::kVolume, "inputVolume", "Volume", "CT or MRI volume with the object"},
           {Kind::kPoints, "inside", "Points inside", "Points inside the object, at least one",
            "--seed"},
           {Kind::kPoints, "outside", "Points outside",
            "Points that are not of the object, where the surface went too far", "--outside"},
           {Kind::kPointFile, "inside_file", "File of points inside",
            "Points inside from a file: .mrk.json or .fcsv", "--seed"},
           {Kind::kPointFile, "outside_file", "File of points outside",
            "Points outside from a file: .mrk.json or .fcsv", "--outside"}}};
}

Group results() {
  return {"Results",
          "At least one of the two",
          false,
          {{Kind::kSurface, "surface", "Surface", "Closed triangle surface, in LPS"},
           {Kind::kLabels, "labels", "Label map",
            "Label map on the grid of the volume, 1 inside the surface"}}};
}

std::vector<std::string> preset_names() {
  std::vector<std::string> out = {kNone};
  for (const auto& preset : surf::segment::presets()) out.push_back(preset.name);
  return out;
}

Group options() {
  return {
      "Options",
      "What is left empty is chosen from the volume and the points",
      true,
      {{Kind::kText, "edge_length", "Edge length",
        "Edges of the surface where it is finest, with their unit: 2mm or 1.5vox", "--edge-length"},
       {Kind::kText, "sigma", "Smoothing",
        "Gaussian smoothing of the volume, with its unit: 1mm or 0.5vox", "--sigma"},
       {Kind::kChoice, "preset", "Preset", "Options for one kind of structure", "--preset", kNone,
        preset_names()},
       {Kind::kText, "energy", "Energy",
        "Terms NAME[:key=value,...] apart by blanks, such as chan-vese area:weight=1; "
        "`surfseg segment --energy list` prints what there is",
        "--energy"},
       {Kind::kChoice,
        "topology",
        "Topology",
        "free: sheets that meet are joined, necks are cut; fixed: they are held apart; genus0: "
        "free, but without handles",
        "--topology",
        "free",
        {"free", "fixed", "genus0"}},
       {Kind::kFlag, "fill_cavities", "Fill cavities", "Fill cavities, with all that lies in them",
        "--fill-cavities", "false"},
       {Kind::kNumber, "min_component", "Least component (mm^3)",
        "Components of less volume are dropped", "--min-component", "0"},
       {Kind::kChoice,
        "keep",
        "Keep",
        "Keep all components, the largest, or the seeded: those that contain a point inside",
        "--keep",
        "all",
        {"all", "largest", "seeded"}}}};
}

Group measures() {
  return {"Measures",
          "Of the surface, after a run",
          false,
          {{Kind::kGivenNumber, "volume_ml", "Volume (ml)", "Volume that the surface encloses", "",
            "0"},
           {Kind::kGivenNumber, "area_cm2", "Area (cm^2)", "Area of the surface", "", "0"},
           {Kind::kGivenText, "verdict", "Verdict",
            "How far the answer is to be trusted, and where to look", "", kNone}}};
}

}  // namespace

std::vector<Group> parameter_groups() {
  return {volume_and_points(), results(), options(), measures()};
}

std::vector<Parameter> parameters_of(const std::vector<Group>& groups) {
  std::vector<Parameter> out;
  for (const Group& group : groups)
    out.insert(out.end(), group.parameters.begin(), group.parameters.end());
  return out;
}

bool is_given_back(const Parameter& parameter) {
  return parameter.kind == Kind::kGivenNumber || parameter.kind == Kind::kGivenText;
}

std::string flag_of(const Parameter& parameter) { return "--" + parameter.name; }

}  // namespace surfseg::slicer
