#include "libsurf/segment/candidate.h"

#include <fmt/format.h>

#include <algorithm>

#include "libsurf/segment/detail/point_text.h"

namespace surf::segment {
namespace {

/// Whether a click has changed what there was.
template <int Dim>
bool has_found(const ClickSearch<Dim>& search) {
  if (!search.before) return true;
  if (search.has_evolved && search.before->clicks.size() == search.clicks.size()) return false;
  const std::vector<Rung<Dim>>&now = search.found, &before = search.before->found;
  return !std::equal(now.begin(), now.end(), before.begin(), before.end(),
                     [](const Rung<Dim>& a, const Rung<Dim>& b) {
                       return a.score == b.score && a.inside == b.inside;
                     });
}

}  // namespace

template <int Dim>
std::vector<Candidate<Dim>> candidates(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                                       const ClickSearch<Dim>& search) {
  std::vector<Candidate<Dim>> out;
  for (const ClickSearch<Dim>* at = &search; at; at = at->before.get()) {
    if (!has_found(*at)) continue;
    std::size_t rank = 0;
    for (Proposal<Dim>& proposal : proposals<Dim>(setting, grid, *at)) {
      const bool is_chosen = proposal.place == at->chosen;
      out.push_back({std::move(proposal), at->clicks.back(), at->clicks.size(), ++rank, is_chosen});
    }
  }
  return out;
}

template <int Dim>
std::string to_string(const Candidate<Dim>& candidate) {
  const std::string content = Dim == 3
                                  ? fmt::format("{:.4g} ml", candidate.proposal.enclosed / 1000)
                                  : fmt::format("{:.4g} mm^2", candidate.proposal.enclosed);
  return fmt::format("click {}, {} ({}) mm, rank {}{}: {}, {}", candidate.n_click,
                     candidate.click.side == Side::kInside ? "inside" : "outside",
                     point_text<Dim>(candidate.click.point_mm), candidate.rank,
                     candidate.is_chosen ? ", chosen" : "", content, to_string(candidate.proposal));
}

#define SURF_INSTANTIATE(Dim)                                                \
  template std::vector<Candidate<Dim>> candidates<Dim>(                      \
      const Setting<Dim>&, const SearchGrid<Dim>&, const ClickSearch<Dim>&); \
  template std::string to_string<Dim>(const Candidate<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
