// What segment and replay of a program share: the image that is read, and where shapes go.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/common/objects.h"
#include "tools/common/segment_command.h"

namespace surfseg {

/// @tparam TheFiles  what was typed: `output`, a pattern, and `mask`; read(path, series_uid) gives
///                   the image, series_uid() that which was typed, and setting(image) what is
///                   segmented
template <int Dim, class TheFiles>
class ImageCommand : public SegmentCommand<Dim> {
 public:
  static constexpr int kDimension = Dim;
  using Files = TheFiles;
  using Image = decltype(std::declval<Files>().read({}, {}));

  /// @param files  are kept, as the others are
  ImageCommand(const CLI::App& command, const RunArguments& arguments, const Files& files)
      : SegmentCommand<Dim>(command, arguments), files_(files) {}

 protected:
  /// Reads the image in this file, with notes to progress().
  /// @param series_uid  where none was typed
  std::shared_ptr<const surf::segment::Setting<Dim>> open(const std::string& path,
                                                          const std::string& series_uid = {}) {
    path_ = path;
    image_ = files_.read(path, series_uid);
    for (const std::string& note : image_->source().notes) this->progress().note("note: " + note);
    return Files::setting(*image_);
  }
  const Files& files() const { return files_; }
  /// Once it is open.
  const Image& image() const { return *image_; }

  std::string output() const override { return files_.output; }
  std::string image_path() const override { return path_; }
  std::string series_uid() const override { return files_.series_uid(); }
  std::string labels_path() const override { return files_.mask; }
  void write(const surf::segment::Object<Dim>& object,
             const surf::segment::Finished<Dim>& finished) const override {
    this->write_shape(object_path(files_.output, object.name), finished, object);
  }

 private:
  const Files& files_;
  std::string path_;
  std::optional<Image> image_;
};

}  // namespace surfseg
