// The table of energies on the command line, the same in both programs.
#pragma once

#include "tests/cli/program.h"

namespace surfseg::test {

inline const std::vector<std::string> kEnergyNames = {
    "minimal-surface", "alignment",          "prescribed-curvature",
    "average-edge",    "average-alignment",  "area",
    "volume",          "anisotropic",        "willmore",
    "chan-vese",       "region-competition", "local-means",
    "window",          "mumford-shah"};

class EnergyProgram : public Program {
 protected:
  void expect_list_in_place_of_a_run() const {
    const Outcome list = must({"segment", "--energy", "area", "--energy", "list"});
    EXPECT_EQ(list.err, "");
    for (const std::string& name : kEnergyNames)
      EXPECT_NE(("\n" + list.out).find("\n" + name + "\n    "), std::string::npos) << name;
    for (const char* text :
         {"\n    lambda          strength of an edge [intensity/mm]; > 0; default: a quarter of",
          "\n    sign            1 for bright objects", "; 1, 0, -1; default: 1\n", "(5.1)"})
      EXPECT_NE(list.out.find(text), std::string::npos) << text << "\n" << list.out;
    EXPECT_TRUE(files().empty());
  }

  void expect_names_in_the_help() const {
    const std::string help = must({"segment", "--help"}).out;
    std::string words;  // the help breaks lines anywhere
    for (const char c : help)
      if (!std::isspace(static_cast<unsigned char>(c))) words += c;
    for (const std::string& name : kEnergyNames)
      EXPECT_NE(words.find(name), std::string::npos) << name;
  }

  void expect_suggestion() const {
    const Outcome outcome =
        run({"segment", "gone.nii", "--seed", "1,2", "--energy", "windwo", "-o", "out.vtp"});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_NE(outcome.err.find("energy 'windwo' is unknown; did you mean 'window'?"),
              std::string::npos)
        << outcome.err;
  }
};

/// The tests of one program.
#define ENERGY_PROGRAM_TESTS(Suite)                                                 \
  using Suite = EnergyProgram;                                                      \
  TEST_F(Suite, ListsTheEnergiesInPlaceOfARun) { expect_list_in_place_of_a_run(); } \
  TEST_F(Suite, NamesTheEnergiesInTheHelp) { expect_names_in_the_help(); }          \
  TEST_F(Suite, SuggestsTheEnergyThatWasMeant) { expect_suggestion(); }             \
  static_assert(true, "for the semicolon")

}  // namespace surfseg::test
