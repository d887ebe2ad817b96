// Where the files of a case lie: a folder of derivatives as BIDS has it (docs/batch.md).
#pragma once

#include <string>

namespace surfseg::batch {

/// The files of one case, relative to the folder of all. Surfaces have {object} in their names
/// where there are several.
struct CaseFiles {
  /// @param has_objects  there are several objects, each with a label in the map
  CaseFiles(const std::string& name, bool has_objects);

  std::string surface, labels, recipe, picture, thumbnail, report;
  std::string label_names;  ///< table of the labels; "" without objects
  std::string sidecar;      ///< of the labels
};

/// "sub-NAME"
std::string case_folder(const std::string& name);
/// The last file to be written of a case.
std::string summary_file(const std::string& name);

/// Makes the folder with what says that it is a derivative of a data set.
/// @throws surf::OutputError
void prepare_derivatives(const std::string& folder);

}  // namespace surfseg::batch
