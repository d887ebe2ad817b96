#include <fmt/format.h>

#include <algorithm>

#include "libsurf/segment/detail/nucleation.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr int kMostRounds = 3;

template <int Dim>
class Cavities : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    for (int round = 1; round <= kMostRounds; ++round) {
      const auto model = work.fields.model(field_options(work.options, work.sigma_mm));
      const auto energy = make_energy<Dim>(work.energies, context(work, *model));
      energy->reset({work.shape.points, work.shape.elements});
      auto holes = find_holes<Dim>(work.setting(), work.shape, *energy);
      const bool is_held = std::erase_if(holes, [&](const Hole<Dim>& hole) {
                             return holds_a_click(work, hole);
                           }) > 0;
      if (open_holes<Dim>(work.setting(), work.shape, holes, work.edge_length_mm, *energy) == 0) {
        if (round == 1 && !is_held) work.notes.push_back(nothing_to_open(work));
        return true;
      }
      Minimisation<Dim> out;
      out.name = fmt::format("cavities {}", round);
      out.terms = work.energies;
      out.sigma_mm = work.sigma_mm;
      out.flow = work.options.flow;
      out.shape = shape_options(work, work.edge_length_mm, work.sigma_mm);
      if (!minimise(work, out)) return false;
    }
    return true;
  }

 private:
  static std::string nothing_to_open(const Work<Dim>& work) {
    return fmt::format(
        "no {} is opened: the energy asks for none more{}", Dim == 3 ? "cavity" : "hole",
        are_fitted<Dim>(work.energies)
            ? ", since it looks near the boundary alone; a click outside takes one away"
            : "");
  }
  static bool holds_a_click(const Work<Dim>& work, const Hole<Dim>& hole) {
    const double least = hole.radius_mm + held_distance_mm(work.cell_mm());
    const std::vector<mesh::HeldPoint<Dim>> held = held_points<Dim>(work.clicks);  // of strokes all
    return std::any_of(held.begin(), held.end(), [&](const mesh::HeldPoint<Dim>& each) {
      return each.is_inside && (each.point - hole.center).norm() < least;
    });
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> cavities_stage() {
  return std::make_unique<Cavities<Dim>>();
}

template StagePointer<2> cavities_stage<2>();
template StagePointer<3> cavities_stage<3>();

}  // namespace surf::segment
