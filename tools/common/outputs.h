// Outputs are checked before the work is done, so that an hour's run does not end in a typing
// error.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "libsurf/io/space.h"
#include "tools/common/cli_app.h"

namespace surfseg {

/// An option that names an output file, and the name; an empty name is no output.
using Output = std::pair<std::string, std::string>;

/// Whether a file that is there is one of those that are read where `input` is: itself, a slice of
/// the same series, the voxels of a header.
bool is_read_with(const std::string& input, const std::string& path);

/// Each file can be created, and no two outputs are the same file, nor is one an input or read with
/// one.
/// @param inputs  that are read as well: what names them, as "--marks" or "the input", and the file
/// @throws surf::UsageError   a name given twice, a file that is read
/// @throws surf::OutputError  the folder is missing or cannot be written to, the name is a folder's
///                            or a write-protected file's
void check_outputs(const std::vector<Output>& outputs, const std::vector<Output>& inputs = {});

/// @throws surf::UsageError  a name that does not end as a volume's; an empty one is no output
void check_volume_name(const std::string& option, const std::string& path);
/// @throws surf::UsageError  a name that does not end as a label map's; an empty one is no output
void check_label_map_name(const std::string& option, const std::string& path);
/// @throws surf::UsageError  a name that does not end in .png; an empty one is no output
void check_picture(const std::string& option, const std::string& path);

/// --output-space: "ras" or "lps", which `space` holds already.
/// @param of  what has the frame, such as "the file"
void add_output_space(CLI::App& command, std::string& space, const std::string& of,
                      const std::string& group);

/// Of "ras" or "lps".
surf::io::Space file_space(const std::string& word);

}  // namespace surfseg
