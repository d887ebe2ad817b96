// The pixels of DICOM files; within the library surf_dicom.
#pragma once

#include <cstddef>
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

/// Decompresses the pixels of one file after the other, by GDCM in a child process, which aborts on
/// damaged ones: Debian's is built with its assertions on, and its decoders meet what no walk over
/// the elements sees.
class DicomPixels {
 public:
  DicomPixels();

  /// Reads the frames of a file; the child goes on to the next one meanwhile.
  /// @param next  empty file: none
  /// @throws InputError      its frames have another size or number, or cannot be read
  /// @throws std::bad_alloc  the child has no memory for them
  ScalarType load(const DicomFrames& frames, const DicomFrames& next);
  /// The values of a frame of that file, from 0.
  const std::byte* frame(int frame) const;

 private:
  void ask(const DicomFrames& frames);

  ChildProcess child_;
  std::string asked_, loaded_;
  ScalarType type_ = ScalarType::kUint8;
  std::size_t n_frame_bytes_ = 0;
  std::vector<std::byte> pixels_;
};

}  // namespace surf::volume
