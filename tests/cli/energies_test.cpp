#include "tests/cli/energies.h"

namespace surfseg::test {
namespace {

using SurfaceEnergies = EnergyProgram;

TEST_F(SurfaceEnergies, ListsTheEnergiesInPlaceOfARun) { expect_list_in_place_of_a_run(); }
TEST_F(SurfaceEnergies, NamesTheEnergiesInTheHelp) { expect_names_in_the_help(); }
TEST_F(SurfaceEnergies, SuggestsTheEnergyThatWasMeant) { expect_suggestion(); }

}  // namespace
}  // namespace surfseg::test
