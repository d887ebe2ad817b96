// libtiff without its messages on stderr.
#pragma once

#include <tiffio.h>

namespace surf::curve {

/// libtiff prints through handlers of the whole process, which this takes away while it lives.
class QuietTiff {
 public:
  QuietTiff() : error_(TIFFSetErrorHandler(nullptr)), warning_(TIFFSetWarningHandler(nullptr)) {}
  ~QuietTiff() {
    TIFFSetErrorHandler(error_);
    TIFFSetWarningHandler(warning_);
  }
  QuietTiff(const QuietTiff&) = delete;
  QuietTiff& operator=(const QuietTiff&) = delete;

 private:
  TIFFErrorHandler error_, warning_;
};

}  // namespace surf::curve
