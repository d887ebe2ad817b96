// The table of energy kinds as text, JSON, and in the documentation.
#include "libsurf/segment/energy_description.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "libsurf/segment/energy_kind.h"

namespace surf::segment {
namespace {

/// Lines of a text that begin so, but for heads of tables; other tests of the same process may have
/// added kinds "test-...".
std::vector<std::string> lines_with(const std::string& text, const std::string& begin) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with(begin) && !line.starts_with("| `test-") && !line.starts_with("| `--"))
      out.push_back(line);
  return out;
}

std::string docs() {
  std::ifstream stream(SURFSEG_SOURCE_DIR "/docs/energies.md");
  return {std::istreambuf_iterator<char>(stream), {}};
}

template <int Dim>
void expect_all_in_text() {
  const std::string text = describe_energies<Dim>();
  for (const EnergyKind<Dim>* kind : all_kinds<Dim>()) {
    EXPECT_NE(text.find(kind->name + "\n    " + kind->formula + "\n"), std::string::npos)
        << kind->name;
    EXPECT_FALSE(kind->formula.empty() || kind->description.empty()) << kind->name;
    for (const auto& parameter : kind->parameters) {
      EXPECT_NE(text.find("    " + parameter.key + " "), std::string::npos) << parameter.key;
      EXPECT_FALSE(parameter.meaning.empty() || parameter.standard.text.empty())
          << kind->name << " " << parameter.key;
    }
  }
}

TEST(EnergyTable, NamesEveryKindAndParameterInItsText) {
  expect_all_in_text<2>();
  expect_all_in_text<3>();
}

TEST(EnergyTable, IsJson) {
  const auto table = nlohmann::json::parse(energies_as_json<3>());
  ASSERT_EQ(table.size(), all_kinds<3>().size());
  const auto& first = table[0];
  EXPECT_EQ(first["name"], "minimal-surface");
  EXPECT_EQ(first["parameters"][0]["key"], "gamma0");
  EXPECT_EQ(first["parameters"][0]["default"], 1);
  EXPECT_TRUE(first["parameters"][1]["default"].is_null());
  EXPECT_EQ(first["parameters"][2]["unit"], "intensity/mm");
  EXPECT_EQ(first["parameters"][2]["range"]["lowest"], 0);
  EXPECT_EQ(first["parameters"][2]["range"]["excludes_lowest"], true);
  EXPECT_TRUE(first["parameters"][2]["range"]["highest"].is_null());
}

// What has to be written there is printed.
TEST(EnergyTable, IsThatOfTheDocumentation) {
  const std::string generated = parameters_as_markdown();
  EXPECT_EQ(lines_with(docs(), "| `"), lines_with(generated, "| `"))
      << "docs/energies.md, Parameters, should be\n"
      << generated;
}

TEST(EnergyTable, OfTheDocumentationNamesEveryEnergy) {
  std::set<std::string> expected, found;
  for (const EnergyKind<3>* kind : all_kinds<3>())
    if (!kind->name.starts_with("test-")) expected.insert(kind->name);
  for (const std::string& line : lines_with(docs(), "| [")) {
    const std::string cell = line.substr(0, line.find(" | "));
    for (auto at = cell.find('`'); at != std::string::npos; at = cell.find('`', at + 1)) {
      const auto end = cell.find('`', at + 1);
      found.insert(cell.substr(at + 1, end - at - 1));
      at = end;
    }
  }
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace surf::segment
