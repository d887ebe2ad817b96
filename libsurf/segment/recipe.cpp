#include "libsurf/segment/recipe.h"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/detail/recipe_json.h"

namespace surf::segment {
namespace {

using Json = nlohmann::ordered_json;

template <int Dim>
void check_image(const RecipeContent<Dim>& recipe, const Setting<Dim>& setting) {
  const std::string& hash = setting.content_hash();
  if (recipe.image_content != hash)
    throw OtherImageError(
        fmt::format("recipe: belongs to another image: '{}' with content {}; this one has {}",
                    recipe.image_path, recipe.image_content.substr(0, 12), hash.substr(0, 12)));
}

/// What it says of the image; "" if that is missing.
std::string word_of_image(const std::string& recipe, const char* key) {
  const Json json = parse_recipe(recipe);
  try {
    return json.contains("image") ? json["image"].value(key, "") : "";
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("recipe: {}", error.what()));
  }
}

}  // namespace

template <int Dim>
std::string to_recipe(const Segmentation<Dim>& segmentation, const std::string& image_path,
                      const std::string& series_uid) {
  const Setting<Dim>& setting = segmentation.setting();
  std::vector<RecipeObject<Dim>> objects;
  for (const int id : segmentation.objects()) {
    const Object<Dim>& first = segmentation.first(id);
    objects.push_back({first.name, first.colour, segmentation.history(id)});
  }
  Json image = {{"path", image_path},
                {"size", setting.extent().in_file.size},
                {"content", setting.content_hash()}};
  if (!series_uid.empty()) image["series_uid"] = series_uid;
  return recipe_text<Dim>(image, objects);
}

template <int Dim>
void write_recipe(const std::string& path, const Segmentation<Dim>& segmentation,
                  const std::string& image_path, const std::string& series_uid) {
  write_bytes(path, to_recipe<Dim>(segmentation, image_path, series_uid));
}

std::string image_of_recipe(const std::string& recipe) { return word_of_image(recipe, "path"); }

std::string series_of_recipe(const std::string& recipe) {
  return word_of_image(recipe, "series_uid");
}

int dimension_of_recipe(const std::string& recipe) {
  const Json dimension = parse_recipe(recipe).value("dimension", Json());
  if (dimension != 2 && dimension != 3)
    throw InputError(fmt::format("recipe: dimension: expected 2 or 3; got {}", dimension.dump()));
  return dimension.get<int>();
}

namespace {

/// A name that an object had once, or one like it that no other object has: names are unique at any
/// one time alone.
template <int Dim>
std::string past_name(const Segmentation<Dim>& segmentation, const std::string& name, int besides) {
  const auto is_taken = [&](const std::string& wanted) {
    const std::vector<int> ids = segmentation.objects();
    return std::any_of(ids.begin(), ids.end(), [&](int id) {
      return id != besides && segmentation.object(id).name == wanted;
    });
  };
  std::string out = name;
  for (int n = 2; is_taken(out); ++n) out = fmt::format("{} ({})", name, n);
  return out;
}

/// The place of the last renaming in an object's history; -1 if there is none.
template <int Dim>
int last_renaming(const std::vector<Action<Dim>>& history) {
  int out = -1;
  for (int n = 0; n < int(history.size()); ++n)
    if (std::holds_alternative<Rename>(history[std::size_t(n)])) out = n;
  return out;
}

/// Adds the recipe's objects, and gives each entry to act(id, action), which says whether to go on.
template <int Dim, class Act>
void for_entries(const std::string& recipe, Segmentation<Dim>& segmentation, const Act& act) {
  const RecipeContent<Dim> content = recipe_content<Dim>(parse_recipe(recipe));
  check_image<Dim>(content, segmentation.setting());
  std::vector<int> added;
  std::size_t n_entry = 0;
  try {
    for (const RecipeObject<Dim>& object : content.objects) {
      n_entry = 0;
      const int renaming = last_renaming<Dim>(object.history);
      added.push_back(segmentation.add_object(
          renaming < 0 ? object.name : past_name(segmentation, object.name, 0), object.colour));
      for (Action<Dim> action : object.history) {
        ++n_entry;
        if (auto* rename = std::get_if<Rename>(&action); rename && int(n_entry) <= renaming)
          rename->name = past_name(segmentation, rename->name, added.back());
        if (!act(added.back(), action)) return;
      }
    }
  } catch (const std::exception& error) {
    for (const int id : added) segmentation.remove_object(id);
    throw InputError(n_entry == 0 ? std::string(error.what())
                                  : fmt::format("recipe: object {}, entry {}: {}", added.size(),
                                                n_entry, error.what()));
  }
}

}  // namespace

template <int Dim>
void replay(const std::string& recipe, Segmentation<Dim>& segmentation,
            const ProgressOf<Dim>& progress, const std::stop_token& stop) {
  for_entries<Dim>(recipe, segmentation, [&](int id, const Action<Dim>& action) {
    if (stop.stop_requested()) return false;
    segmentation.apply(id, action, progress, stop);
    return true;
  });
}

template <int Dim>
void load(const std::string& recipe, Segmentation<Dim>& segmentation) {
  for_entries<Dim>(recipe, segmentation, [&](int id, const Action<Dim>& action) {
    segmentation.note(id, action);
    return true;
  });
}

template std::string to_recipe<2>(const Segmentation<2>&, const std::string&, const std::string&);
template std::string to_recipe<3>(const Segmentation<3>&, const std::string&, const std::string&);
template void write_recipe<2>(const std::string&, const Segmentation<2>&, const std::string&,
                              const std::string&);
template void write_recipe<3>(const std::string&, const Segmentation<3>&, const std::string&,
                              const std::string&);
template void load<2>(const std::string&, Segmentation<2>&);
template void load<3>(const std::string&, Segmentation<3>&);
template void replay<2>(const std::string&, Segmentation<2>&, const ProgressOf<2>&,
                        const std::stop_token&);
template void replay<3>(const std::string&, Segmentation<3>&, const ProgressOf<3>&,
                        const std::stop_token&);

}  // namespace surf::segment
