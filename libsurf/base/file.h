// Files that are either written whole or not at all.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace surf {

/// Calls write(temporary) with a name beside `path` that has the same ending, waits until it is on
/// the disk, and renames it to `path`, with the permissions of a file that was there; if write
/// throws, the temporary is removed and `path` is as it was. Where `path` is a link the file it
/// leads to is written, and the link stays. A device, a pipe or /dev/stdout gets the bytes when all
/// of them are ready, and stays what it is.
/// @throws OutputError  the folder does not exist or cannot be written to, nor can the file that is
///                      there, the rename fails
void write_atomically(const std::string& path,
                      const std::function<void(const std::string&)>& write);

/// Whether the file that is there, if one is, may be written to; else errno says why not. Another
/// can take the place of a write-protected one, which is not what its owner wanted.
bool may_be_written(const std::string& path);

/// Whether `path` takes bytes but is no file that another could take the place of: a device, a
/// pipe, a socket, and what a descriptor of a process has open, as /dev/stdout.
bool is_stream(const std::string& path);

/// The file that a link leads to, be it there or not; what is no link as it is. Where one leads to
/// what a process has open, as /dev/stdout, that: /proc/self/fd/1.
std::string end_of_links(const std::string& path);

/// write_atomically() of bytes that are ready.
void write_bytes(const std::string& path, std::string_view bytes);

/// The files of a folder, links to files too, by their names; none of what lies in folders in it.
/// @throws InputError  the folder cannot be read to its end
std::vector<std::string> files_in(const std::string& folder);

/// Ending of the file's name in lower case with its dot: ".stl", ".nii.gz"; "" if none.
std::string extension(const std::string& path);

}  // namespace surf
