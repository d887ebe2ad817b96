// ZIP archives in memory; private to io/*.cpp.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace surf::io {

struct ZipMember {
  std::string name;  ///< with / between folders
  std::string_view content;
};

/// The bytes of an archive, deflated. The members' time is ZIP's first, 1980-01-01, so that the
/// same content gives the same bytes.
/// @throws OutputError  more than the 4 GB that an archive without extensions holds
std::string zip_file(const std::vector<ZipMember>& members);

}  // namespace surf::io
