#include "libsurf/segment/history.h"

#include <algorithm>

#include "libsurf/segment/clicks.h"
#include "libsurf/segment/fields.h"

namespace surf::segment {
namespace {

template <int Dim>
std::size_t bytes_of(const Simplices<Dim>& shape) {
  return std::size_t(shape.points.size()) * sizeof(double) +
         std::size_t(shape.elements.size()) * sizeof(int);
}

template <int Dim>
std::size_t bytes_of(const NodeSet<Dim>& nodes) {
  constexpr std::size_t kBits = 64;
  const NodeBox<Dim>& box = nodes.box();
  if (box.n() == 0) return 0;
  const std::size_t row = std::size_t(box.size[0]);
  return box.n() / row * ((row + kBits - 1) / kBits) * sizeof(std::uint64_t);
}

/// Of no matter which shape.
template <int Dim>
bool have_same_energy(const Options<Dim>& a, const Options<Dim>& b) {
  return has_same_grid(a, b) && a.energies == b.energies && a.samples_mm == b.samples_mm &&
         a.seed_radius_mm == b.seed_radius_mm && a.edge_length_mm == b.edge_length_mm &&
         a.geometry_tolerance_mm == b.geometry_tolerance_mm;
}

}  // namespace

template <int Dim>
const std::shared_ptr<const Result<Dim>>& result_to_be_made() {
  static const auto result = [] {
    auto out = std::make_shared<Result<Dim>>();
    out->message = "it has to be made again";
    return std::shared_ptr<const Result<Dim>>(std::move(out));
  }();
  return result;
}

template <int Dim>
std::size_t memory_bytes(const Result<Dim>& result) {
  std::size_t out = sizeof result + bytes_of<Dim>(result.shape) + bytes_of<Dim>(result.start);
  for (const Proposal<Dim>& proposal : result.proposals)
    out += sizeof proposal + bytes_of<Dim>(proposal.shape);
  for (const StageReport& stage : result.stages)
    out += sizeof stage + stage.flow.steps.size() * sizeof(flow::StepRecord);
  if (result.certainty)
    out += std::size_t(result.certainty->deviation_mm.size()) * (2 * sizeof(double) + 1);
  if (!result.search) return out;
  for (const Rung<Dim>& rung : result.search->found)
    out += sizeof rung + bytes_of<Dim>(rung.inside);
  return out + result.search->clicks.size() * (sizeof(Click<Dim>) + sizeof(GridClick<Dim>));
}

template <int Dim>
std::size_t History<Dim>::n_before_repeated() const {
  // What was chosen is in the search of all clicks after it.
  const bool has_choice = std::any_of(
      moments.begin(), moments.begin() + std::ptrdiff_t(n_done),
      [](const Moment& moment) { return std::holds_alternative<Choose>(moment.action); });
  for (std::size_t n = n_done; n > 0; --n) {
    if (moments[n - 1].after.is_made() && has_settled(n)) return n;
    const auto* evolved = std::get_if<Evolve<Dim>>(&moments[n - 1].action);
    if (evolved && evolved->is_anew && !has_choice) return n - 1;
  }
  return 0;
}

template <int Dim>
bool History<Dim>::is_at_rest(const std::vector<Click<Dim>>& others,
                              const ImageExtent<Dim>& extent) const {
  if (now().state() != Outcome::kConverged) return false;
  for (std::size_t n = n_done; n-- > 0;) {
    const Action<Dim>& action = moments[n].action;
    if (const auto* evolved = std::get_if<Evolve<Dim>>(&action))
      return contains_all<Dim>(others, evolved->others) &&
             obeys<Dim>(now().result->shape, now().clicks, extent) &&
             obeys<Dim>(now().result->shape, others, extent);
    if (!std::holds_alternative<AddClick<Dim>>(action) && !std::holds_alternative<Rename>(action) &&
        !std::holds_alternative<Recolour>(action))
      return false;
  }
  return false;
}

template <int Dim>
const typename History<Dim>::Moment* History<Dim>::last_evolution(std::size_t n) const {
  while (n-- > 0) {
    const Action<Dim>& action = moments[n].action;
    const auto* evolved = std::get_if<Evolve<Dim>>(&action);
    if (evolved && evolved->stopped_at != 0) return &moments[n];
    if (std::holds_alternative<TakeBackClick>(action) ||
        std::holds_alternative<SetOptions<Dim>>(action))
      return nullptr;
  }
  return nullptr;
}

template <int Dim>
std::shared_ptr<const Result<Dim>> History<Dim>::settled() const {
  const Moment* moment = last_evolution(n_done);
  return moment && moment->after.state() == Outcome::kConverged ? moment->after.result : nullptr;
}

template <int Dim>
std::shared_ptr<const Result<Dim>> History<Dim>::unfinished() const {
  const Result<Dim>& result = *now().result;
  // After a stop before the first step its stages are those of before, which may have come to rest.
  const StageReport* last = result.ending_stage();
  if (!last || (last->outcome != Outcome::kStopped && last->outcome != Outcome::kAtLimit) ||
      result.energies.empty() || result.shape.elements.rows() == 0)
    return nullptr;
  for (std::size_t n = n_done; n-- > 0;) {
    const Action<Dim>& action = moments[n].action;
    if (const auto* evolved = std::get_if<Evolve<Dim>>(&action)) {
      if (evolved->stopped_at == 0) continue;  // it has the result, and the energy, of before
      return have_same_energy(moments[n].after.options, now().options) ? now().result : nullptr;
    }
    if (std::holds_alternative<Propose<Dim>>(action) || std::holds_alternative<Choose>(action) ||
        std::holds_alternative<TakeBackClick>(action))
      return nullptr;
  }
  return nullptr;
}

template <int Dim>
bool History<Dim>::has_lost_click(const std::vector<Click<Dim>>& clicks) const {
  for (std::size_t n = n_done; n-- > 0;) {
    const Action<Dim>& action = moments[n].action;
    const auto* evolved = std::get_if<Evolve<Dim>>(&action);
    if (evolved && evolved->stopped_at != 0)
      return !contains_all<Dim>(clicks, moments[n].after.clicks) ||
             !contains_all<Dim>(clicks, evolved->others);
    if (std::holds_alternative<Propose<Dim>>(action) || std::holds_alternative<Choose>(action))
      return false;
  }
  return false;
}

template const std::shared_ptr<const Result<2>>& result_to_be_made<2>();
template const std::shared_ptr<const Result<3>>& result_to_be_made<3>();
template std::size_t memory_bytes<2>(const Result<2>&);
template std::size_t memory_bytes<3>(const Result<3>&);
template struct History<2>;
template struct History<3>;

}  // namespace surf::segment
