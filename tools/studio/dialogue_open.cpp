// What Dialogue does when a volume or a recipe is opened.
#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/read_volume.h"
#include "tools/studio/dialogue.h"
#include "tools/studio/folder.h"

namespace surfseg::studio {
namespace {

constexpr std::size_t kMostFieldBytes = std::size_t(1) << 30;
constexpr std::size_t kLeastPastBytes = std::size_t(4) << 20, kVoxelsPerPastByte = 2;

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  if (!in) throw surf::InputError(fmt::format("{}: cannot be read", path.string()));
  return out.str();
}

/// What is told where a recipe was opened under a name of its own; "" where the scan's was.
std::string note_on_keeping(const std::filesystem::path& recipe,
                            const std::filesystem::path& beside) {
  if (recipe == beside) return "";
  std::string note =
      fmt::format("what is done is kept in {}, which was opened", recipe.filename().string());
  if (!std::filesystem::exists(beside)) return note;
  return fmt::format("{}; {} stays as it is", note, beside.filename().string());
}

/// Beside it, under a name that is free.
std::filesystem::path moved_aside(const std::filesystem::path& path) {
  for (int n = 1;; ++n) {
    std::filesystem::path aside = path;
    aside += fmt::format(".{}", n);
    if (std::filesystem::exists(aside)) continue;
    std::filesystem::rename(path, aside);
    return aside;
  }
}

}  // namespace

std::size_t max_past_bytes(const surf::volume::Volume& volume) {
  return kLeastPastBytes + volume.n_voxels() / kVoxelsPerPastByte;
}

void Dialogue::open(const std::filesystem::path& path,
                    const std::optional<std::string>& series_uid) {
  close();
  {
    std::lock_guard lock(mutex_);
    opening_ = [this, path, series_uid] {
      try {
        forget_volume();  // of a request that came between
        read_volume(path, series_uid);
      } catch (const std::exception& error) {
        // Half open it would have no object, and its recipe would be waited for in vain.
        if (recipe_.empty()) forget_volume();
        end_job();
        publish_error(text_of(error));
      }
    };
  }
  wake_.notify_all();
}

void Dialogue::close() {
  do_now(
      [this] {
        forget_volume();
        {
          std::lock_guard lock(mutex_);
          opening_.reset();
        }
        publish();
      },
      true);
}

void Dialogue::forget_volume() {
  segmentation_.reset();
  volume_.reset();
  checked_.clear();
  removed_.clear();
  brought_back_.clear();
  std::lock_guard lock(mutex_);
  wanted_.clear();
  recipe_.clear();
}

/// Where the folder holds several series, they are in the state from now on.
surf::volume::Volume Dialogue::volume_of(const std::filesystem::path& image,
                                         const std::optional<std::string>& series_uid) {
  try {
    return surf::volume::read_volume(image.string(), {.series_uid = series_uid});
  } catch (const surf::InputError&) {
    if (!std::filesystem::is_directory(image) || series_uid) throw;
    auto several = surf::volume::dicom_series(image.string());
    if (several.size() < 2) throw;
    const std::string name = image.filename().string();
    auto& known = series_of_[name] = std::move(several);
    throw surf::InputError(fmt::format("{}: holds {} series: choose one", name, known.size()));
  }
}

void Dialogue::read_volume(const std::filesystem::path& path,
                           const std::optional<std::string>& series_uid) {
  const bool is_opened = is_recipe(path);
  RecipeImage image = is_opened ? image_of_recipe(path) : RecipeImage{path, {}};
  begin_job(0, "open", "reading " + image.path.filename().string());
  if (series_uid) image.series_uid = series_uid;
  const std::filesystem::path beside = recipe_beside(folder_, image.path, image.series_uid);
  const std::filesystem::path recipe = is_opened ? path : beside;
  const surf::volume::Volume volume = volume_of(image.path, image.series_uid);
  auto opened = std::make_shared<OpenVolume>(
      OpenVolume{++last_opened_, image.path.filename().string(), image.series_uid, volume,
                 surf::segment::make_setting(volume), recipe, volume.source().notes});
  if (const std::string note = note_on_keeping(recipe, beside); !note.empty())
    opened->notes.push_back(note);
  volume_ = opened;
  kept_.reset();
  segmentation_ = std::make_unique<surf::segment::Segmentation<3>>(opened->setting, kMostFieldBytes,
                                                                   max_past_bytes(volume));
  if (std::filesystem::exists(recipe)) load_recipe(recipe);
  end_job();
  if (segmentation_->objects().empty()) segmentation_->add_object();
  {
    std::lock_guard lock(mutex_);
    for (const int id : segmentation_->objects())
      if (awaits_evolution(id) || !segmentation_->is_made(id))
        wanted_.push_back({id, awaits_evolution(id)});
  }
  publish();
  const std::string text = recipe_now();
  {
    std::lock_guard lock(mutex_);
    recipe_ = text;
  }
  changed_.notify_all();
  // So that the first click need not wait for it.
  segmentation_->prepare();
}

/// What another studio or program has written there since is moved aside, so that nothing is lost.
/// @throws OutputError  it cannot be
void Dialogue::spare_what_others_keep() {
  const std::filesystem::path recipe = surf::end_of_links(volume_->recipe.string());
  std::error_code status;
  if (!std::filesystem::is_regular_file(recipe, status)) return;
  try {
    if (kept_ && text_of_file(recipe) == *kept_) return;
  } catch (const surf::InputError&) {  // another user's: all the more it is not ours
  }
  try {
    const std::filesystem::path aside = moved_aside(recipe);
    publish_error(fmt::format("{} was written by another studio or program; what it had is now {}",
                              recipe.filename().string(), aside.filename().string()));
  } catch (const std::filesystem::filesystem_error& error) {
    throw surf::OutputError(
        fmt::format("{} is not what this studio has written, and cannot be moved aside: {}",
                    recipe.filename().string(), error.code().message()));
  }
}

/// One that cannot be repeated here is moved aside, so that nothing is lost; where the folder
/// cannot be written the scan can be looked at all the same.
void Dialogue::load_recipe(const std::filesystem::path& recipe) {
  try {
    kept_ = text_of_file(recipe);
    surf::segment::load<3>(*kept_, *segmentation_);
  } catch (const surf::Error& error) {
    try {
      const std::filesystem::path aside = moved_aside(recipe);
      publish_error(fmt::format("{}; it is now {}", error.what(), aside.filename().string()));
    } catch (const std::filesystem::filesystem_error& failure) {
      kept_.reset();  // nothing may be written over it
      publish_error(fmt::format(
          "{}; {} stays as it is, since it cannot be moved aside ({}), and what is done is not "
          "kept: make the folder writable, or copy the scan into one that is",
          error.what(), recipe.filename().string(), failure.code().message()));
    }
  }
}

}  // namespace surfseg::studio
