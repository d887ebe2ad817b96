#include "libcurve/segment/finish.h"

#include "libcurve/io/contour_file.h"

namespace surf::curve {

void write(const std::string& path, const segment::Finished<2>& curves, const Image& image,
           io::Space space) {
  write_contours(path, curves.shape, image, space);
}

}  // namespace surf::curve
