#include "libsurf/segment/recipe.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/detail/options_json.h"

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
  if (what == "take back click") return TakeBackClick{json.at("index").get<std::size_t>()};
  if (what == "options") return SetOptions<Dim>{options_from_json<Dim>(json.at("options"))};
  if (what == "propose") return Propose<Dim>{others_from_json<Dim>(json)};
  if (what == "choose") return Choose{json.at("proposal").get<std::size_t>()};
  if (what == "evolve") {
    Evolve<Dim> out{.others = others_from_json<Dim>(json)};
    if (json.contains("stopped_at")) out.stopped_at = json["stopped_at"].get<int>();
    out.is_anew = json.value("anew", false);
    return out;
  }
  if (what == "rename") return Rename{json.at("name").get<std::string>()};
  if (what == "recolour") return Recolour{json.at("colour").get<Colour>()};
  throw InputError(fmt::format("'{}' is no action", what));
}

Json parse(const std::string& text) {
  Json out;
  try {
    out = Json::parse(text);
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("recipe: not valid JSON: {}", error.what()));
  }
  if (!out.is_object() || out.value("kind", "") != kKind)
    throw InputError(fmt::format("recipe: not a {}: its \"kind\" is missing", kKind));
  const int version = out.value("version", 0);
  if (version > kVersion)
    throw InputError(fmt::format(
        "recipe: version {} is newer than this program's {}; update surfseg", version, kVersion));
  return out;
}

template <int Dim>
void check_image(const Json& recipe, const Setting<Dim>& setting) {
  const int dimension = recipe.value("dimension", 0);
  if (dimension != Dim)
    throw InputError(fmt::format("recipe: made for {}; this is {}",
                                 dimension == 2 ? "an image" : "a volume",
                                 Dim == 2 ? "an image" : "a volume"));
  const std::string hash = setting.content_hash();
  const std::string wanted = recipe.at("image").value("content", "");
  if (wanted != hash)
    throw InputError(fmt::format(
        "recipe: belongs to another image: '{}' with content {}; this one has {}",
        recipe.at("image").value("path", ""), wanted.substr(0, 12), hash.substr(0, 12)));
}

}  // namespace

template <int Dim>
std::string to_recipe(const Segmentation<Dim>& segmentation, const std::string& image_path) {
  const Setting<Dim>& setting = segmentation.setting();
  Json out = {{"kind", kKind},
              {"version", kVersion},
              {"dimension", Dim},
              {"image",
               {{"path", image_path},
                {"size", setting.extent().size},
                {"content", setting.content_hash()}}}};
  out["objects"] = Json::array();
  for (const int id : segmentation.objects()) {
    const Object<Dim>& first = segmentation.first(id);
    Json object = {{"name", first.name}, {"colour", first.colour}};
    object["history"] = Json::array();
    for (const Action<Dim>& action : segmentation.history(id))
      object["history"].push_back(std::visit(ActionToJson<Dim>{}, action));
    out["objects"].push_back(std::move(object));
  }
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

template <int Dim>
void write_recipe(const std::string& path, const Segmentation<Dim>& segmentation,
                  const std::string& image_path) {
  write_bytes(path, to_recipe<Dim>(segmentation, image_path));
}

std::string image_of_recipe(const std::string& recipe) {
  const Json json = parse(recipe);
  return json.contains("image") ? json["image"].value("path", "") : "";
}

namespace {

/// Adds the recipe's objects, and gives each entry to act(id, action), which says whether to go on.
template <int Dim, class Act>
void for_entries(const std::string& recipe, Segmentation<Dim>& segmentation, const Act& act) {
  std::vector<int> added;
  int n_entry = 0;
  try {
    const Json json = parse(recipe);
    check_image<Dim>(json, segmentation.setting());
    for (const Json& object : json.at("objects")) {
      n_entry = 0;
      added.push_back(segmentation.add_object(object.at("name").get<std::string>(),
                                              object.at("colour").get<Colour>()));
      for (const Json& entry : object.at("history")) {
        ++n_entry;
        if (!act(added.back(), action_from_json<Dim>(entry))) return;
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

template std::string to_recipe<2>(const Segmentation<2>&, const std::string&);
template std::string to_recipe<3>(const Segmentation<3>&, const std::string&);
template void write_recipe<2>(const std::string&, const Segmentation<2>&, const std::string&);
template void write_recipe<3>(const std::string&, const Segmentation<3>&, const std::string&);
template void load<2>(const std::string&, Segmentation<2>&);
template void load<3>(const std::string&, Segmentation<3>&);
template void replay<2>(const std::string&, Segmentation<2>&, const ProgressOf<2>&,
                        const std::stop_token&);
template void replay<3>(const std::string&, Segmentation<3>&, const ProgressOf<3>&,
                        const std::stop_token&);

}  // namespace surf::segment
