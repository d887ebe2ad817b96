// The text of a report: each function gives a piece of HTML.
#pragma once

#include <string>

#include "tools/report/report.h"

namespace surfseg::report {

/// "trusted", "check", "doubtful", "none" or "failed": how far the answer goes.
std::string trust_of(const ReportedObject<3>& object);
/// The verdict, the guarantees, whether the volume's border cuts it.
std::string verdict_section(const ReportedObject<3>& object);
/// Measures, intensities, distances to a reference, confidence, components, mesh.
std::string number_sections(const ReportedObject<3>& object);
/// Clicks, energy, stages, proposals.
std::string making_section(const ReportedObject<3>& object, const Case& of);
/// The volume, its affine and hash, the command line, the version.
std::string input_section(const Case& of);
/// A paragraph for a paper, and what to cite.
std::string methods_section(const Case& of);

/// "ct" of the file or folder "scans/ct", and of "scans/ct/".
std::string file_name(const std::string& path);

/// "liver", or "The surface" of the only one.
std::string name_of(const ReportedObject<3>& object);

}  // namespace surfseg::report
