#include "libsurf/segment/history.h"

#include "libsurf/segment/clicks.h"

namespace surf::segment {

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
std::shared_ptr<const Result<Dim>> History<Dim>::settled() const {
  for (std::size_t n = n_done; n-- > 0;) {
    const Action<Dim>& action = moments[n].action;
    if (std::holds_alternative<Evolve<Dim>>(action))
      return moments[n].after.state() == Outcome::kConverged ? moments[n].after.result : nullptr;
    if (std::holds_alternative<TakeBackClick>(action) ||
        std::holds_alternative<SetOptions<Dim>>(action))
      return nullptr;
  }
  return nullptr;
}

template struct History<2>;
template struct History<3>;

}  // namespace surf::segment
