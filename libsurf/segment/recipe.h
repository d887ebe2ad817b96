// The file that repeats a segmentation, to the byte.
#pragma once

#include <string>

#include "libsurf/base/error.h"
#include "libsurf/segment/segmentation.h"

namespace surf::segment {

/// Of a recipe that belongs to another image than the one it is to be done to.
class OtherImageError : public InputError {
 public:
  using InputError::InputError;
};

/// What has been done to all objects, as JSON text: image (path, size, hash of its content),
/// version, and for each object its name, colour and history (docs/file-formats.md).
/// @param image_path  for people and front ends; nothing computes with it
/// @param series_uid  which series of a DICOM folder, where it was chosen; likewise
template <int Dim>
std::string to_recipe(const Segmentation<Dim>& segmentation, const std::string& image_path = {},
                      const std::string& series_uid = {});

/// Written whole or not at all.
/// @throws OutputError
template <int Dim>
void write_recipe(const std::string& path, const Segmentation<Dim>& segmentation,
                  const std::string& image_path = {}, const std::string& series_uid = {});

/// The image that a recipe's text names, as it was given to to_recipe().
/// @throws InputError  not a recipe
std::string image_of_recipe(const std::string& recipe);
/// Likewise the series; "" if none was given.
/// @throws InputError  not a recipe
std::string series_of_recipe(const std::string& recipe);

/// 2 = of an image, 3 = of a volume.
/// @throws InputError  not a recipe
int dimension_of_recipe(const std::string& recipe);

/// Does all that the recipe says; objects that are there already stay.
/// @throws InputError  not a recipe, of a newer version, of another image (OtherImageError) or
///                     dimension, or an entry that cannot be done; then nothing has changed
template <int Dim>
void replay(const std::string& recipe, Segmentation<Dim>& segmentation,
            const ProgressOf<Dim>& progress = {}, const std::stop_token& stop = {});

/// The same, but nothing is computed: Segmentation::make() makes the results, of each object often
/// by its last evolution alone.
/// @throws InputError  as above, but for proposals that are not there
template <int Dim>
void load(const std::string& recipe, Segmentation<Dim>& segmentation);

}  // namespace surf::segment
