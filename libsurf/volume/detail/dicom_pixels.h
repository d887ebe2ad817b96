// The pixels of DICOM files; within the library surf_dicom.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "libsurf/base/detail/child_process.h"
#include "libsurf/volume/detail/raw_scalars.h"

namespace surf::volume {

/// What a file's frames have to be.
struct DicomFrames {
  std::string file;
  std::size_t n_pixels = 0;  ///< of a frame
  std::size_t n_frames = 1;
};

/// Decompresses the pixels of one file after the other, by GDCM in child processes, which aborts on
/// damaged ones: Debian's is built with its assertions on, and its decoders meet what no walk over
/// the elements sees. As many children as threads may run, at most 8 and fewer for large files,
/// each of which has a file ready or in work.
class DicomPixels {
 public:
  /// @param files  in the order in which they are loaded
  explicit DicomPixels(std::vector<DicomFrames> files);

  /// Reads the frames of the next file.
  /// @pre  not all are loaded
  /// @throws InputError      its frames have another size or number, or cannot be read
  /// @throws std::bad_alloc  the child has no memory for them
  ScalarType load_next();
  /// The values of a frame of that file, from 0.
  const std::byte* frame(int frame) const;

 private:
  ChildProcess& child_of(std::size_t file) { return *children_[file % children_.size()]; }
  void ask(std::size_t file);

  std::vector<DicomFrames> files_;
  std::vector<std::unique_ptr<ChildProcess>> children_;
  std::size_t n_loaded_ = 0;
  std::size_t n_frame_bytes_ = 0;
  std::vector<std::byte> pixels_;
};

}  // namespace surf::volume
