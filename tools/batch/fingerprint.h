// What a case is made from, as a few digits: by them a batch knows what is done already.
#pragma once

#include <string>

#include "tools/batch/case_list.h"

namespace surfseg::batch {

/// SHA-1 of the row's settings, the contents of the files that it names, of its preset, and the
/// program's version. Of a header with its data in other files all count, of a DICOM folder, or a
/// scan that is one file in one, all files in it. A file that is not there counts as such.
std::string fingerprint(const Case& row);

}  // namespace surfseg::batch
