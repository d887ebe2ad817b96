#include "libsurf/volume/cell_pieces.h"

namespace surf::volume {
namespace {

PieceCorner between(const PieceCorner& a, const PieceCorner& b, int axis, double at) {
  const double t = (at - a.index[axis]) / (b.index[axis] - a.index[axis]);
  PieceCorner out{a.index + t * (b.index - a.index),
                  a.barycentric + t * (b.barycentric - a.barycentric)};
  out.index[axis] = at;
  return out;
}

/// Dunavant 1985, degree 7.
PieceRule make_rule() {
  PieceRule rule;
  int n = 0;
  const auto add = [&](double a, double b, double weight) {
    rule.points[n] = {a, b, 1 - a - b};
    rule.weights[n++] = weight;
  };
  add(1.0 / 3, 1.0 / 3, -0.149570044467670);
  for (const auto& [a, weight] : {std::array{0.260345966079038, 0.175615257433204},
                                  std::array{0.065130102902216, 0.053347235608839}}) {
    add(a, a, weight);
    add(a, 1 - 2 * a, weight);
    add(1 - 2 * a, a, weight);
  }
  const double a = 0.638444188569809, b = 0.312865496004875, c = 1 - a - b;
  for (const auto& [p, q] : {std::array{a, b}, std::array{a, c}, std::array{b, a}, std::array{b, c},
                             std::array{c, a}, std::array{c, b}})
    add(p, q, 0.077113760890257);
  return rule;
}

}  // namespace

void split(const Piece& piece, int axis, double at, Piece& below, Piece& above) {
  below.n = above.n = 0;
  for (int m = 0; m < piece.n; ++m) {
    const PieceCorner& here = piece.corners[m];
    const PieceCorner& next = piece.corners[m + 1 == piece.n ? 0 : m + 1];
    const double from = here.index[axis] - at, to = next.index[axis] - at;
    if (from <= 0) below.add(here);
    if (from >= 0) above.add(here);
    if ((from < 0 && to > 0) || (from > 0 && to < 0)) {
      // From the lower end, so that both neighbours of an edge get the same point.
      const PieceCorner corner =
          from < 0 ? between(here, next, axis, at) : between(next, here, axis, at);
      below.add(corner);
      above.add(corner);
    }
  }
}

const PieceRule& piece_rule() {
  static const PieceRule rule = make_rule();
  return rule;
}

}  // namespace surf::volume
