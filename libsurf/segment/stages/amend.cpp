#include "libsurf/segment/detail/amend.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

/// The parameter of the first term that has one of this name; 0 if none has.
double parameter_of(const std::vector<EnergyTerm>& terms, const std::string& name,
                    const std::string& key) {
  for (const EnergyTerm& term : terms)
    if (term.name == name)
      if (const auto found = term.parameters.find(key); found != term.parameters.end())
        return found->second;
  return 0;
}

/// Where clicks have changed the region of a large shape that had come to rest, and nowhere else,
/// the shape is to evolve again, with the energy that it has; anew if the change is large.
template <int Dim>
class Amend : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const std::optional<Amended<Dim>> amended = amend(work);
    if (!amended) return fit_stage<Dim>()->run(work);
    work.start = work.setting().in_file_order(amended->shape);
    work.shape = work.start;
    work.start_is_given = true;
    work.region = amended->region;
    return begins(work, "amend",
                  fmt::format("{:.3g} mm^{} have changed; the rest of the {} stays",
                              amended->changed, Dim, work.setting().noun()));
  }

 private:
  static std::optional<Amended<Dim>> amend(Work<Dim>& work) {
    const Result<Dim>& settled = *work.settled;
    if (!is_amended<Dim>(settled.shape) || !work.search || work.search->found.empty() ||
        work.options.topology == mesh::Topology::kFixed)
      return std::nullopt;
    const auto grid = work.fields.search_grid(field_options(work.options, 0), work.options.sigma_mm,
                                              work.options.box_mm);
    std::vector<Click<Dim>> clicks;
    for (const Click<Dim>& click :
         clicks_in_box<Dim>(work.setting().extent(), work.options.box_mm, work.clicks))
      if (std::find(settled.search->clicks.begin(), settled.search->clicks.end(), click) ==
          settled.search->clicks.end())
        clicks.push_back(click);
    // What the search saw of the shape, if it did.
    const ClickSearch<Dim>* seen = work.search.get();
    while (seen && (!seen->has_evolved || seen->clicks != settled.search->clicks))
      seen = seen->before.get();
    work.energies = settled.energies;
    static_cast<Lengths&>(work) = settled;
    return amended<Dim>(work.setting(), *grid,
                        {settled.shape, parameter_of(work.energies, "local-means", "reach"),
                         (seen ? *seen : *settled.search).inside(), work.search->inside(), clicks},
                        shape_options(work, work.edge_length_mm, work.sigma_mm));
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> amend_stage() {
  return std::make_unique<Amend<Dim>>();
}

template StagePointer<2> amend_stage<2>();
template StagePointer<3> amend_stage<3>();

}  // namespace surf::segment
