#include "tests/cli/energies.h"

namespace surfseg::test {

ENERGY_PROGRAM_TESTS(CurveEnergies);

}  // namespace surfseg::test
