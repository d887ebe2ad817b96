// The page of group.html, built into the program from tools/batch/page.
#pragma once

#include "tools/common/page.h"

namespace surfseg::batch {

PageFiles page_files();

}  // namespace surfseg::batch
