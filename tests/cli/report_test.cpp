// The page that tells of a case: its numbers are those of the summary, its bytes repeat, and
// nothing from outside is markup.
#include <fmt/format.h>

#include <numbers>

#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class Report : public FileTest {
 protected:
  Report() { must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "ball.nii"}); }

  static int count(const std::string& text, const std::string& piece) {
    int n = 0;
    for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1))
      ++n;
    return n;
  }
  /// The cell beside a name in the tables.
  static std::string cell(const std::string& page, const std::string& name) {
    const std::string head = fmt::format("<th scope=\"row\">{}</th><td>", name);
    const std::size_t at = page.find(head);
    if (at == std::string::npos) return "no row " + name;
    const std::size_t begin = at + head.size();
    return page.substr(begin, page.find("</td>", begin) - begin);
  }
  static std::string text(const nlohmann::json& number, double factor = 1) {
    return fmt::format("{:.6g}", factor * number.get<double>());
  }
};

TEST_F(Report, HasTheNumbersOfTheSummaryAndOfEvaluate) {
  must({"segment", "ball.nii", "--seed", "0,0,0", "-o", "a.stl", "--mask", "m.nii.gz", "-q"});
  must({"segment", "ball.nii", "--seed", "0,0,0", "--outside", "-12,0,0", "-o", "b.stl", "--json",
        "s.json", "--report", "r.html", "--reference", "m.nii.gz", "-q"});
  must({"evaluate", "b.stl", "--reference", "m.nii.gz", "--json", "e.json"});
  const auto summary = json("s.json"), scores = json("e.json");
  const std::string page = bytes("r.html");
  const auto& form = summary["form"];
  EXPECT_EQ(cell(page, "Volume"), text(summary["volume_mm3"], 1e-3) + " ml");
  EXPECT_EQ(cell(page, "Area"), text(summary["area_mm2"], 1e-2) + " cm²");
  EXPECT_EQ(cell(page, "Sphericity"), text(form["sphericity"]));
  EXPECT_EQ(cell(page, "Feret diameter, largest"), text(form["feret_largest_mm"]) + " mm");
  EXPECT_EQ(cell(page, "Feret diameter, smallest"), text(form["feret_smallest_mm"]) + " mm");
  EXPECT_EQ(cell(page, "Triangles"), text(summary["triangles"]));
  EXPECT_EQ(cell(page, "Inside: mean"), text(summary["intensities"]["inside"]["mean"]));
  EXPECT_EQ(cell(page, "Strength of the edge: median"),
            text(summary["certainty"]["edge_strength"]["median"]));
  for (const auto& [name, key] : {std::pair{"Mean distance", "mean_mm"},
                                  {"95 % distance", "p95_mm"},
                                  {"Hausdorff distance", "max_mm"}})
    EXPECT_EQ(cell(page, name), text(scores["distance"][key]) + " mm");
  EXPECT_EQ(cell(page, "Dice"), text(scores["dice"]));
  EXPECT_EQ(summary["reference"]["dice"], scores["dice"]);
  // The phantom's ball: radius 0.3 of the extent.
  const double radius = std::cbrt(summary["volume_mm3"].get<double>() * 0.75 / std::numbers::pi);
  EXPECT_GT(form["sphericity"], 0.99);
  EXPECT_LE(form["sphericity"], 1.0);
  EXPECT_NEAR(form["feret_largest_mm"], 2 * radius, 0.05 * radius);
  EXPECT_NEAR(form["feret_smallest_mm"], 2 * radius, 0.05 * radius);
  EXPECT_NEAR(form["semi_axes_mm"][0], radius, 0.02 * radius);
  // Nine slices, through both clicks.
  EXPECT_GE(count(page, "<img src=\"data:image/jpeg;base64,"), 3);
  EXPECT_NE(page.find("Through click 2, outside, at (-12.0, 0.0, 0.0) mm"), std::string::npos);
  EXPECT_NE(page.find("--seed=0,0,0 --outside=-12,0,0 --output=b.stl"), std::string::npos);
  EXPECT_NE(page.find("sform"), std::string::npos);
  EXPECT_NE(page.find("PhD thesis"), std::string::npos);
  EXPECT_LT(page.find("class=\"verdict"), page.find("Size and form"));
  EXPECT_LT(page.size(), 5'000'000u);
}

TEST_F(Report, RepeatsToTheByteForAnyNumberOfThreads) {
  const Words words = {"segment", "ball.nii", "--seed",   "0,0,0",
                       "-o",      "a.stl",    "--report", "r.html"};
  must(joined(words, {"-q", "--threads", "1"}));
  const std::string first = bytes("r.html");
  must(joined(words, {"-q", "--threads", "2"}));
  EXPECT_EQ(bytes("r.html"), first);
}

TEST_F(Report, TakesNothingFromOutsideForMarkup) {
  std::filesystem::rename(file("ball.nii"), file("<b onclick=x>&'.nii"));
  must({"segment", "<b onclick=x>&'.nii", "--object", "it's <i>&", "--seed", "0,0,0", "-o",
        "{object}.stl", "--report", "r.html", "-q"});
  const std::string page = bytes("r.html");
  EXPECT_EQ(page.find("<b onclick"), std::string::npos);
  EXPECT_NE(page.find("<h1>&lt;b onclick=x&gt;&amp;&#39;.nii</h1>"), std::string::npos);
  EXPECT_NE(page.find("<h2>it&#39;s &lt;i&gt;&amp;</h2>"), std::string::npos);
  EXPECT_EQ(page.find("<i>"), std::string::npos);
  EXPECT_EQ(count(page, "</script>"), 2);
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.find("http"), page.find("http-equiv"));  // and no other
  EXPECT_EQ(count(page, "http"), 1);
}

TEST_F(Report, TellsOfFailuresToo) {
  const Outcome outcome =
      run({"segment", "ball.nii", "--seed=-15,-15,-15", "-o", "a.stl", "--report", "r.html", "-q"});
  ASSERT_EQ(outcome.exit_code, 8) << outcome.err;
  const std::string page = bytes("r.html");
  EXPECT_NE(page.find("class=\"verdict failed\""), std::string::npos);
  EXPECT_NE(page.find("no surface"), std::string::npos);
  EXPECT_EQ(page.find("/*scene*/"), std::string::npos);
  EXPECT_EQ(page.find("<canvas"), std::string::npos);
}

// How the evolution ended is not why there is no surface.
TEST_F(Report, SaysWhyAResultWasNotWritten) {
  const Outcome outcome = run({"segment", "ball.nii", "--seed", "0,0,0", "--min-component", "100ml",
                               "-o", "a.stl", "--report", "r.html", "--json", "s.json", "-q"});
  ASSERT_EQ(outcome.exit_code, 6) << outcome.err;
  const std::string why = "the components that are asked for leave nothing";
  EXPECT_NE(bytes("r.html").find("</b> no surface: " + why), std::string::npos);
  EXPECT_TRUE(json("s.json").value("not_written", "").starts_with(why));
}

TEST_F(Report, TellsWhatEarlierObjectsHaveOfOne) {
  must({"segment", "ball.nii", "--object", "first & best", "--seed", "0,0,0", "--object", "second",
        "--seed", "2,2,2", "-o", "{object}.stl", "--report", "r.html", "--json", "s.json", "-q"});
  const auto walls = json("s.json")["objects"][1]["walls"];
  ASSERT_EQ(walls.size(), 1u);
  const std::string ml = fmt::format("{:.4g} ml", walls[0]["removed_mm3"].get<double>() / 1000);
  const std::string page = bytes("r.html");
  EXPECT_NE(page.find(ml + " that first &amp; best has too went"), std::string::npos);
  EXPECT_EQ(count(page, " has too went"), 1);
}

TEST_F(Report, RefusesWhatItCannotDo) {
  EXPECT_EQ(
      run({"segment", "ball.nii", "--seed", "0,0,0", "-o", "a.stl", "--report", "r.pdf"}).exit_code,
      2);
  EXPECT_EQ(run({"segment", "ball.nii", "--seed", "0,0,0", "-o", "a.stl", "--reference-label", "1"})
                .exit_code,
            2);
  EXPECT_EQ(run({"segment", "ball.nii", "--seed", "0,0,0", "-o", "a.stl", "--reference", "no.nii"})
                .exit_code,
            3);
}

}  // namespace
}  // namespace surfseg::test
