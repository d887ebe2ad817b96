#include "libsurf/segment/finish.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/segment/detail/float_step.h"

namespace surf::segment {
namespace {

/// What was looked for and what to try.
template <int Dim>
std::string no_object(const Result<Dim>& result) {
  if (result.outcome == Outcome::kVanished)
    return result.message +
           "; start from a larger shape or with shorter edges, or give the length or area of the "
           "boundary less weight";
  if (result.message.empty()) return "nothing has been made of the clicks yet; let it evolve";
  return fmt::format(
      "no object stands out round the clicks: {}; click in the middle of the object, or say what "
      "it is by Options::energies",
      result.message);
}

template <int Dim>
Finished<Dim> checked(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                      const std::string& extension) {
  Finished<Dim> out;
  out.shape = setting.rounded_to_file(shape, extension);
  out.measures = setting.measures(out.shape);
  if (out.measures.passed) return out;
  if (out.shape.points == shape.points || !setting.measures(shape).passed)
    throw InvalidMesh(out.measures.verdict);
  throw InvalidMesh(out.measures.verdict + float_step_text(float_step<Dim>(shape.points)));
}

}  // namespace

template <int Dim>
Finished<Dim> finish(const Setting<Dim>& setting, const Result<Dim>& result,
                     const std::string& extension) {
  if (!has_shape(result.outcome)) throw NoObject(no_object(result));
  if (result.shape.elements.rows() == 0 && result.outcome == Outcome::kStopped)
    throw NoObject("interrupted before there was a first shape");
  if (result.shape.elements.rows() == 0 && !result.removed.empty())
    throw InvalidMesh("the components that are asked for leave nothing; " + result.notes.back());
  Finished<Dim> out = checked<Dim>(setting, result.shape, extension);
  out.certainty = result.certainty;
  return out;
}

template <int Dim>
Finished<Dim> finish(const Setting<Dim>& setting, const Proposal<Dim>& proposal,
                     const std::string& extension) {
  return checked<Dim>(setting, proposal.shape, extension);
}

Eigen::VectorXd curvature(const Finished<3>& surface) {
  const fem::Geometry<3> shape(surface.shape.points, surface.shape.elements);
  return fem::mean_curvature<3>(shape, fem::stiffness<3>(shape));
}

void write(const std::string& path, const Finished<3>& surface, io::WriteOptions options) {
  options.arrays.push_back({"curvature_per_mm", curvature(surface)});
  if (surface.certainty) {
    const Certainty<3>& certainty = *surface.certainty;
    const std::vector<char>& flags = certainty.has_edge;
    options.arrays.push_back({"deviation_mm", certainty.deviation_mm});
    options.arrays.push_back({"edge_strength", certainty.edge_strength});
    options.arrays.push_back({"has_edge", Eigen::Map<const Eigen::Matrix<char, Eigen::Dynamic, 1>>(
                                              flags.data(), Eigen::Index(flags.size()))
                                              .cast<double>()});
  }
  io::write_surface(path, surface.shape, options);
}

template Finished<2> finish<2>(const Setting<2>&, const Result<2>&, const std::string&);
template Finished<3> finish<3>(const Setting<3>&, const Result<3>&, const std::string&);
template Finished<2> finish<2>(const Setting<2>&, const Proposal<2>&, const std::string&);
template Finished<3> finish<3>(const Setting<3>&, const Proposal<3>&, const std::string&);

}  // namespace surf::segment
