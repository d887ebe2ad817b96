#include "tests/cli/energies.h"

namespace surfseg::test {

ENERGY_PROGRAM_TESTS(SurfaceEnergies);

}  // namespace surfseg::test
