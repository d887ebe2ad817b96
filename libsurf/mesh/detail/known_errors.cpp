#include "libsurf/mesh/detail/known_errors.h"

#include <array>
#include <limits>

#include "libsurf/fem/indicators.h"

namespace surf::mesh {
namespace {

constexpr const char* kOfFaceName = "surf:quadrature_errors";
constexpr const char* kIntegrandsName = "surf:quadrature_integrands";
constexpr std::size_t kMost = 3;  // integrands; with more, nothing is kept

struct FaceErrors {
  Eigen::Matrix3d corners = Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
  std::array<double, kMost> errors{};
};

using Integrands = KnownErrors::Integrands;

template <class Handle>
Handle property_of(TriMesh& mesh, const char* name) {
  Handle handle;
  if (!mesh.get_property_handle(handle, name)) mesh.add_property(handle, name);
  return handle;
}

}  // namespace

KnownErrors::KnownErrors(TriMesh& mesh, const Integrands& integrands)
    : mesh_(mesh), integrands_(integrands) {
  const auto of = property_of<OpenMesh::MPropHandleT<Integrands>>(mesh, kIntegrandsName);
  if (mesh.property(of) == integrands) return;
  mesh.property(of) = integrands;
  const auto known = property_of<OpenMesh::FPropHandleT<FaceErrors>>(mesh, kOfFaceName);
  for (const auto face : mesh.faces()) mesh.property(known, face) = FaceErrors();
}

Eigen::MatrixXd KnownErrors::operator()(const fem::Geometry<3>& shape, std::span<const int> faces) {
  const Elements<3>& T = shape.elements();
  Eigen::MatrixXd out(T.rows(), Eigen::Index(integrands_.size()));
  if (integrands_.size() > kMost) {
    for (Eigen::Index k = 0; k < out.cols(); ++k)
      out.col(k) = fem::quadrature_error(shape, *integrands_[std::size_t(k)]);
    return out;
  }
  const auto known = property_of<OpenMesh::FPropHandleT<FaceErrors>>(mesh_, kOfFaceName);
  const auto of_element = [&](Eigen::Index t) -> FaceErrors& {
    return mesh_.property(known, FaceHandle(faces.empty() ? int(t) : faces[std::size_t(t)]));
  };
  std::vector<Eigen::Index> fresh;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const Eigen::Matrix3d corners = shape.points()(T.row(t), Eigen::all);
    if (of_element(t).corners != corners) fresh.push_back(t);
  }
  for (std::size_t k = 0; k < integrands_.size(); ++k) {
    const Eigen::VectorXd errors = fem::quadrature_error(shape, fresh, *integrands_[k]);
    for (std::size_t n = 0; n < fresh.size(); ++n)
      of_element(fresh[n]).errors[k] = errors[Eigen::Index(n)];
    for (Eigen::Index t = 0; t < T.rows(); ++t) out(t, Eigen::Index(k)) = of_element(t).errors[k];
  }
  // Now that they are known: sampling may have thrown.
  for (const Eigen::Index t : fresh) of_element(t).corners = shape.points()(T.row(t), Eigen::all);
  return out;
}

}  // namespace surf::mesh
