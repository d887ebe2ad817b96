// The linear systems of curves, thesis 3.6.1: each node has two neighbours, but for the ends of
// parts of curves.
#pragma once

#include "libsurf/base/types.h"

namespace surf::flow {

/// Solves a system whose matrix couples the nodes of polygons, closed or open, with their
/// neighbours: by elimination along each polygon, O(n), numbered in any way. Without pivoting: for
/// symmetric positive definite matrices and such with scaled rows.
///
/// One solve of the H1 system on a circle of 1e3 / 1e4 / 1e5 nodes takes 0.02 / 0.2 / 2.1 ms, by
/// conjugate gradients 0.8 / 64 / 1,160 (243 to 825 iterations), by SimplicialLDLT with AMD 0.2 /
/// 11 / 88.
/// @pre  every row has an entry for its node and each of the neighbours, and no other; closed
///       polygons have at least three nodes
Eigen::VectorXd solve_cyclic_tridiagonal(const SparseMatrix& matrix, const Eigen::VectorXd& rhs);

}  // namespace surf::flow
