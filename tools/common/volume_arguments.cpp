#include "tools/common/volume_arguments.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "libsurf/volume/read_volume.h"
#include "tools/common/option_group.h"

namespace surfseg {

void VolumeArguments::add_to(CLI::App& command, const std::string& group) {
  OptionGroup(command, group)
      .add_with_default("--frame-index", frame_index, "Frame of a 4-D volume, from 0");
  OptionGroup(command, group)
      .add("--series-uid", series_uid,
           "Series of a DICOM folder that holds several, by its SeriesInstanceUID");
}

VolumeArguments VolumeArguments::or_series(const std::string& uid) const {
  VolumeArguments out = *this;
  if (out.series_uid.empty()) out.series_uid = uid;
  return out;
}

void VolumeArguments::check() const {
  if (frame_index < 0)
    throw surf::UsageError(fmt::format("--frame-index: expected 0 or more; got {}", frame_index));
}

void VolumeArguments::check_unused(const std::string& path, const std::string& what) const {
  for (const auto& [option, is_typed] :
       {std::pair{"--frame-index", frame_index != 0}, {"--series-uid", !series_uid.empty()}})
    if (is_typed)
      throw surf::UsageError(fmt::format("{}: {} {}, not a volume", option, path, what));
}

surf::volume::Volume VolumeArguments::read(const std::string& path) const {
  check();
  surf::volume::ReadOptions options;
  options.frame_index = frame_index;
  if (!series_uid.empty()) options.series_uid = series_uid;
  surf::volume::Volume volume = surf::volume::read_volume(path, options);
  if (const auto& source = volume.source(); source.n_frames > 1 && frame_index == 0)
    surf::log(surf::LogLevel::kWarning,
              fmt::format("{}: the first of {} frames is used; --frame-index names another", path,
                          source.n_frames));
  return volume;
}

}  // namespace surfseg
