#include "tools/report/report.h"

#include <fmt/format.h>

#include <stdexcept>

#include "libsurf/base/base64.h"
#include "libsurf/io/slices.h"
#include "tools/common/html.h"
#include "tools/report/page.h"
#include "tools/report/scene.h"
#include "tools/report/sections.h"

namespace surfseg::report {
namespace {

using surf::Vector;
using surf::io::Picture;

/// Of the page.
constexpr std::size_t kMostBytes = 5'000'000;
/// Of all pictures together, before base64.
constexpr std::size_t kMostPictureBytes = 2'400'000;
constexpr int kQuality = 85;
constexpr std::size_t kMostClickPictures = 12;

/// The pictures of one object, as long as there is room for them.
class Pictures {
 public:
  explicit Pictures(std::size_t most_bytes) : left_(most_bytes) {}

  /// A figure of what `draw` gives for a width, narrower if there is not enough room.
  template <class Draw>
  std::string figure(const std::string& caption, int width, const Draw& draw) {
    for (; width >= 300; width = width * 2 / 3) {
      const Picture picture = draw(width);
      const std::string bytes = surf::io::jpeg_bytes(picture, kQuality);
      if (bytes.size() > left_) continue;
      left_ -= bytes.size();
      return fmt::format(
          "<figure><img src=\"data:image/jpeg;base64,{}\" width=\"{}\" height=\"{}\" alt=\"{}\">"
          "<figcaption>{}</figcaption></figure>\n",
          surf::base64(bytes), picture.width(), picture.height(), html_text(caption),
          html_text(caption));
    }
    return fmt::format("<p class=\"soft\">{}: left out to keep this page below 5 MB</p>\n",
                       html_text(caption));
  }

 private:
  std::size_t left_;
};

std::string point_text(const Vector<3>& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f})", p[0], p[1], p[2]);
}

/// Nine slices, the slices through each click, and through the most doubtful place.
std::string pictures_of(const ReportedObject<3>& object, const Case& of, std::size_t most_bytes) {
  if (!object.finished) return "";
  Pictures pictures(most_bytes);
  const surf::Triangles& shape = object.finished->shape;
  std::vector<surf::io::Mark> marks;
  for (const auto& click : object.object->clicks)
    marks.push_back({click.point_mm, click.side == surf::segment::Side::kInside});
  std::string out = pictures.figure(
      "Nine axial slices from superior to inferior: the outline, clicks inside (green) and outside "
      "(pink)",
      1080, [&](int width) {
        surf::io::SheetOptions options;
        options.n_slices = 9;
        options.columns = 3;
        options.width = width;
        options.marks = marks;
        return surf::io::draw_sheet(shape, of.volume, options);
      });
  const auto through = [&](const std::string& caption, const Vector<3>& point) {
    out += pictures.figure(caption, 960, [&](int width) {
      surf::io::SliceOptions options;
      options.center_ras_mm = point;
      options.width = width;
      options.marks = marks;
      return surf::io::draw_slices(shape, of.volume, options);
    });
  };
  const auto& clicks = object.object->clicks;
  for (std::size_t n = 0; n < std::min(clicks.size(), kMostClickPictures); ++n)
    through(fmt::format("Through click {}, {}, at {} mm (RAS)", n + 1,
                        marks[n].is_inside ? "inside" : "outside", point_text(clicks[n].point_mm)),
            clicks[n].point_mm);
  if (clicks.size() > kMostClickPictures)
    out += fmt::format("<p class=\"soft\">{} more clicks have no picture of their own</p>\n",
                       clicks.size() - kMostClickPictures);
  if (const auto& certainty = object.finished->certainty; certainty && certainty->next_click_mm)
    through(fmt::format("Through the place where the next click would tell most, {} mm (RAS)",
                        point_text(*certainty->next_click_mm)),
            *certainty->next_click_mm);
  return "<div class=\"figures\">\n" + out + "</div>\n";
}

std::string viewer(const Scene& scene) {
  if (scene.json.is_null()) return "";
  return fmt::format(
      "<section id=\"viewer\" hidden><h2>In three dimensions</h2>\n"
      "<div id=\"stage\"><canvas id=\"solid\" tabindex=\"0\" aria-label=\"The surface; arrow keys "
      "turn it\"></canvas><div id=\"axes\" aria-hidden=\"true\"></div></div>\n"
      "<p id=\"tools\"></p>\n<p class=\"soft\">Drag to turn, Shift + drag to move, wheel to come "
      "nearer, arrow keys as well. {}</p></section>\n"
      "<p id=\"no-viewer\">Without scripts and WebGL 2 the surface cannot be turned here; the "
      "pictures below show it.</p>\n",
      html_text(scene.thinned));
}

/// What of the page does not depend on the scene.
struct Text {
  std::string verdicts, sections;
};

Text text_of(const Case& of) {
  Text out;
  const std::size_t share = kMostPictureBytes / std::max<std::size_t>(1, of.objects.size());
  for (const auto& object : of.objects) {
    out.verdicts += verdict_section(object);
    out.sections += fmt::format("<section><h2>{}</h2>\n{}{}{}</section>\n",
                                html_text(name_of(object)), pictures_of(object, of, share),
                                number_sections(object), making_section(object, of));
  }
  out.sections += input_section(of) + methods_section(of);
  return out;
}

std::string page_of(const Case& of, const Text& text, const Scene& shown) {
  std::string out(page_files().html);
  const std::string file = file_name(of.volume.source().path);
  put(out, "/*style*/", std::string(page_files().style));
  put(out, "<!--title-->", html_text(file));
  put(out, "<!--heading-->", html_text(file));
  put(out, "<!--body-->", text.verdicts + viewer(shown) + text.sections);
  put(out, "{/*scene*/}",
      json_in_script(
          shown.json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)));
  put(out, "/*script*/", std::string(page_files().script));
  return out;
}

}  // namespace

/// Pictures and viewer have budgets that leave room for the text of a case; where the whole is too
/// large nevertheless, the viewer shows the surfaces coarser.
std::string page(const Case& of) {
  const Text text = text_of(of);
  for (Eigen::Index most = kMostTriangles;; most /= 2) {
    std::string out = page_of(of, text, scene(of.objects, most));
    if (out.size() < kMostBytes || most / 2 < kFewestTriangles) return out;
  }
}

}  // namespace surfseg::report
