#include "libsurf/segment/detail/recipe_json.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/segment/detail/options_json.h"
#include "libsurf/segment/detail/whole_number.h"

namespace surf::segment {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 2;  // 2: what an object saw of the others, and strokes
constexpr const char* kKind = "surfseg recipe";

template <int Dim>
Vector<Dim> point_from_json(const Json& json) {
  const auto numbers = json.get<std::vector<double>>();
  if (numbers.size() != std::size_t(Dim))
    throw InputError(fmt::format("a point has {} numbers; expected {}", numbers.size(), Dim));
  return Eigen::Map<const Vector<Dim>>(numbers.data());
}

template <int Dim>
Json points_to_json(const std::vector<Vector<Dim>>& points) {
  Json out = Json::array();
  for (const Vector<Dim>& point : points) out.push_back(point_to_json<Dim>(point));
  return out;
}

template <int Dim>
std::vector<Vector<Dim>> points_from_json(const Json& json) {
  std::vector<Vector<Dim>> out;
  for (const Json& point : json) out.push_back(point_from_json<Dim>(point));
  return out;
}

/// Those of the others are all outside.
template <int Dim>
Json others_to_json(const std::vector<Click<Dim>>& others) {
  Json out = Json::array();
  for (const Click<Dim>& click : others) {
    Json entry = {{"point_mm", point_to_json<Dim>(click.point_mm)}};
    if (!click.stroke_mm.empty()) entry["stroke_mm"] = points_to_json<Dim>(click.stroke_mm);
    out.push_back(std::move(entry));
  }
  return out;
}

template <int Dim>
std::vector<Click<Dim>> others_from_json(const Json& action) {
  std::vector<Click<Dim>> out;
  if (!action.contains("others")) return out;
  for (const Json& entry : action["others"]) {
    out.push_back({point_from_json<Dim>(entry.at("point_mm")), Side::kOutside});
    if (entry.contains("stroke_mm"))
      out.back().stroke_mm = points_from_json<Dim>(entry["stroke_mm"]);
  }
  return out;
}

template <int Dim>
struct ActionToJson {
  Json operator()(const AddClick<Dim>& a) const {
    Json out = {{"do", "click"},
                {"side", a.click.side == Side::kInside ? "inside" : "outside"},
                {"point_mm", point_to_json<Dim>(a.click.point_mm)}};
    if (!a.click.stroke_mm.empty()) out["stroke_mm"] = points_to_json<Dim>(a.click.stroke_mm);
    return out;
  }
  Json operator()(const TakeBackClick& a) const {
    return {{"do", "take back click"}, {"index", a.index}};
  }
  Json operator()(const SetOptions<Dim>& a) const {
    return {{"do", "options"}, {"options", to_json<Dim>(a.options)}};
  }
  Json operator()(const Propose<Dim>& a) const {
    Json out = {{"do", "propose"}};
    if (!a.others.empty()) out["others"] = others_to_json<Dim>(a.others);
    return out;
  }
  Json operator()(const Choose& a) const { return {{"do", "choose"}, {"proposal", a.proposal}}; }
  Json operator()(const Evolve<Dim>& a) const {
    Json out = {{"do", "evolve"}};
    if (!a.others.empty()) out["others"] = others_to_json<Dim>(a.others);
    if (a.stopped_at) out["stopped_at"] = *a.stopped_at;
    if (a.is_anew) out["anew"] = true;
    return out;
  }
  Json operator()(const Rename& a) const { return {{"do", "rename"}, {"name", a.name}}; }
  Json operator()(const Recolour& a) const { return {{"do", "recolour"}, {"colour", a.colour}}; }
};

Colour colour_from_json(const Json& json) {
  Colour out{};
  if (!json.is_array() || json.size() != out.size())
    throw InputError(fmt::format("a colour is three numbers; got {}", json.dump()));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = std::uint8_t(whole_number(json[n], 0, 255));
  return out;
}

template <int Dim>
Action<Dim> action_from_json(const Json& json) {
  const auto what = json.at("do").get<std::string>();
  if (what == "click") {
    const auto side = json.at("side").get<std::string>();
    if (side != "inside" && side != "outside")
      throw InputError(fmt::format("side '{}' is neither inside nor outside", side));
    AddClick<Dim> out{{point_from_json<Dim>(json.at("point_mm")),
                       side == "inside" ? Side::kInside : Side::kOutside}};
    if (json.contains("stroke_mm")) out.click.stroke_mm = points_from_json<Dim>(json["stroke_mm"]);
    return out;
  }
  if (what == "take back click")
    return TakeBackClick{std::size_t(whole_number(json.at("index"), 0))};
  if (what == "options") return SetOptions<Dim>{options_from_json<Dim>(json.at("options"))};
  if (what == "propose") return Propose<Dim>{others_from_json<Dim>(json)};
  if (what == "choose") return Choose{std::size_t(whole_number(json.at("proposal"), 0))};
  if (what == "evolve") {
    Evolve<Dim> out{.others = others_from_json<Dim>(json)};
    if (json.contains("stopped_at")) out.stopped_at = whole_number(json["stopped_at"]);
    out.is_anew = json.value("anew", false);
    return out;
  }
  if (what == "rename") return Rename{json.at("name").get<std::string>()};
  if (what == "recolour") return Recolour{colour_from_json(json.at("colour"))};
  throw InputError(fmt::format("'{}' is no action", what));
}

/// Name and colour, then the entries; what is wrong is told with its number.
template <int Dim>
RecipeObject<Dim> object_from_json(const Json& json, std::size_t n_object) {
  std::size_t n_entry = 0;
  try {
    RecipeObject<Dim> out{
        json.at("name").get<std::string>(), colour_from_json(json.at("colour")), {}};
    for (const Json& entry : json.at("history")) {
      ++n_entry;
      out.history.push_back(action_from_json<Dim>(entry));
    }
    return out;
  } catch (const std::exception& error) {
    const std::string what = one_line(error.what());
    throw InputError(n_entry == 0
                         ? fmt::format("recipe: object {}: {}", n_object, what)
                         : fmt::format("recipe: object {}, entry {}: {}", n_object, n_entry, what));
  }
}

}  // namespace

Json parse_recipe(const std::string& text) {
  Json out;
  Json version;
  try {
    out = Json::parse(text);
    if (!out.is_object() || out.value("kind", "") != kKind)
      throw InputError(fmt::format("recipe: not a {0}: its \"kind\" is not \"{0}\"", kKind));
    version = out.value("version", Json(0));
    if (!version.is_number_integer())
      throw InputError(fmt::format("recipe: version {} is no whole number", version.dump()));
  } catch (const Json::parse_error& error) {
    throw InputError(fmt::format("recipe: not valid JSON: {}", error.what()));
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("recipe: {}", error.what()));
  }
  if (version > kVersion)
    throw InputError(
        fmt::format("recipe: version {} is newer than this program's {}; update surfseg",
                    version.dump(), kVersion));
  return out;
}

template <int Dim>
RecipeContent<Dim> recipe_content(const Json& recipe) {
  RecipeContent<Dim> out;
  try {
    if (const Json dimension = recipe.value("dimension", Json(0)); dimension != Dim)
      throw InputError(fmt::format("recipe: made for {}; this is {}",
                                   dimension == 2 ? "an image" : "a volume",
                                   Dim == 2 ? "an image" : "a volume"));
    const Json& image = recipe.at("image");
    out.image_path = image.value("path", "");
    out.image_content = image.value("content", "");
    for (const Json& object : recipe.at("objects"))
      out.objects.push_back(object_from_json<Dim>(object, out.objects.size() + 1));
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("recipe: {}", error.what()));
  }
  return out;
}

template <int Dim>
std::string recipe_text(const Json& image, const std::vector<RecipeObject<Dim>>& objects) {
  Json out = {{"kind", kKind}, {"version", kVersion}, {"dimension", Dim}, {"image", image}};
  out["objects"] = Json::array();
  for (const RecipeObject<Dim>& object : objects) {
    Json entry = {{"name", object.name}, {"colour", object.colour}};
    entry["history"] = Json::array();
    for (const Action<Dim>& action : object.history)
      entry["history"].push_back(std::visit(ActionToJson<Dim>{}, action));
    out["objects"].push_back(std::move(entry));
  }
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

template RecipeContent<2> recipe_content<2>(const Json&);
template RecipeContent<3> recipe_content<3>(const Json&);
template std::string recipe_text<2>(const Json&, const std::vector<RecipeObject<2>>&);
template std::string recipe_text<3>(const Json&, const std::vector<RecipeObject<3>>&);

}  // namespace surf::segment
