// The folder that a studio was started in: what can be opened in it, and what may be written.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace surfseg::studio {

/// Something that can be opened.
struct FolderEntry {
  std::string name;  ///< in the folder
  std::string kind;  ///< "volume", "DICOM folder", "recipe"
  std::uintmax_t bytes = 0;
};

/// What the names and first bytes of the files say, sorted by name; nothing is read whole. At most
/// 2,000.
std::vector<FolderEntry> entries_of(const std::filesystem::path& folder);

/// Whether the folder has DICOM files.
bool is_dicom_folder(const std::filesystem::path& folder);
/// Whether a file is a recipe by its first bytes.
bool is_recipe(const std::filesystem::path& path);

/// Where the state of a dialogue about this image is kept: "ct.nii.gz.surfseg.json" in the folder;
/// of each series in a file of its own.
std::filesystem::path recipe_beside(const std::filesystem::path& folder,
                                    const std::filesystem::path& image,
                                    const std::optional<std::string>& series_uid);

/// The image that a recipe belongs to.
struct RecipeImage {
  std::filesystem::path path;             ///< by the name it has, beside the recipe
  std::optional<std::string> series_uid;  ///< of a DICOM folder, if one was chosen
};

/// @throws surf::InputError  not a recipe, or no such file
RecipeImage image_of_recipe(const std::filesystem::path& recipe);

/// Whether a path in the folder is a link, and what it leads to, be it there or not, lies outside.
bool leads_out(const std::filesystem::path& folder, const std::filesystem::path& path);

/// The path of a file to write.
/// @param name  of the file, without a folder
/// @throws surf::UsageError  a name with a folder in it, hidden, too long or with control
///                           characters; that of a folder or a link
std::filesystem::path output_path(const std::filesystem::path& folder, const std::string& name);

}  // namespace surfseg::studio
