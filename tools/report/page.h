// The page of a report, built into the program from tools/report/page.
#pragma once

#include "tools/common/page.h"

namespace surfseg::report {

PageFiles page_files();

}  // namespace surfseg::report
