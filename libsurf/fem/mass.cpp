#include "libsurf/fem/mass.h"

#include "libsurf/fem/detail/assemble.h"
#include "libsurf/fem/p1.h"

namespace surf::fem {

template <int Dim>
SparseMatrix mass(const Geometry<Dim>& shape, const Eigen::VectorXd& w) {
  return assemble<Dim>(shape,
                       [&](Eigen::Index t) { return p1_mass<Dim>(w[t] * shape.measures()[t]); });
}

template <int Dim>
SparseMatrix mass_nodal_weight(const Geometry<Dim>& shape, const Eigen::VectorXd& w) {
  // On an element of measure 1: <phi_i phi_j phi_k> = (Dim-1)! a! b! c! / (Dim+2)! with the
  // multiplicities of i, j, k: 6, 2, 1 over Dim (Dim+1) (Dim+2).
  constexpr double kUnit = 1.0 / (Dim * (Dim + 1) * (Dim + 2));
  return assemble<Dim>(shape, [&](Eigen::Index t) {
    Eigen::Matrix<double, Dim, Dim> local;
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) {
        double sum = 0;
        for (int k = 0; k < Dim; ++k) {
          const int equal = (i == j) + (j == k) + (i == k);
          sum += w[shape.elements()(t, k)] * (equal == 3 ? 6 : equal == 1 ? 2 : 1);
        }
        local(i, j) = shape.measures()[t] * kUnit * sum;
      }
    return local;
  });
}

template SparseMatrix mass<2>(const Geometry<2>&, const Eigen::VectorXd&);
template SparseMatrix mass<3>(const Geometry<3>&, const Eigen::VectorXd&);
template SparseMatrix mass_nodal_weight<2>(const Geometry<2>&, const Eigen::VectorXd&);
template SparseMatrix mass_nodal_weight<3>(const Geometry<3>&, const Eigen::VectorXd&);

}  // namespace surf::fem
