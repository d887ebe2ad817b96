// Recipes as JSON: their text, and what it says.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libsurf/segment/action.h"

namespace surf::segment {

/// An object as a recipe has it.
template <int Dim>
struct RecipeObject {
  std::string name;
  Colour colour = {};
  std::vector<Action<Dim>> history;
};

/// What a recipe says.
template <int Dim>
struct RecipeContent {
  std::string image_path, image_content;  ///< the hash; both may be empty
  std::vector<RecipeObject<Dim>> objects;
};

/// The document, if it is a recipe of a version that is known.
/// @throws InputError
nlohmann::ordered_json parse_recipe(const std::string& text);

/// @throws InputError  another dimension, or an entry that is none, by object and entry
template <int Dim>
RecipeContent<Dim> recipe_content(const nlohmann::ordered_json& recipe);

/// @param image  "path", "size" and "content" of the image
template <int Dim>
std::string recipe_text(const nlohmann::ordered_json& image,
                        const std::vector<RecipeObject<Dim>>& objects);

}  // namespace surf::segment
