#include "tests/cli/energies.h"

namespace surfseg::test {
namespace {

using CurveEnergies = EnergyProgram;

TEST_F(CurveEnergies, ListsTheEnergiesInPlaceOfARun) { expect_list_in_place_of_a_run(); }
TEST_F(CurveEnergies, NamesTheEnergiesInTheHelp) { expect_names_in_the_help(); }
TEST_F(CurveEnergies, SuggestsTheEnergyThatWasMeant) { expect_suggestion(); }

}  // namespace
}  // namespace surfseg::test
