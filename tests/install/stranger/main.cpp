#include <cstdio>

#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"

int main() {
  const auto verification = surf::mesh::verify(surf::mesh::ball({0, 0, 0}, 10, 2));
  std::printf("%s\n", verification.closed && verification.manifold ? "closed, manifold" : "broken");
  return verification.passed() ? 0 : 1;
}
