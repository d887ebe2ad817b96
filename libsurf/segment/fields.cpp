#include "libsurf/segment/fields.h"

#include "libsurf/segment/proposal.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {

template <int Dim>
Fields<Dim>::Fields(std::shared_ptr<const Setting<Dim>> setting, std::size_t max_bytes)
    : setting_(std::move(setting)), max_bytes_(max_bytes) {}

template <int Dim>
std::shared_ptr<EnergyModel<Dim>> Fields<Dim>::model(const FieldOptions& options) {
  for (auto entry = models_.begin(); entry != models_.end(); ++entry) {
    if (entry->options != options) continue;
    models_.splice(models_.begin(), models_, entry);
    return entry->model;
  }
  shrink();
  models_.push_front({options, setting_->make_model(options)});
  return models_.front().model;
}

template <int Dim>
std::shared_ptr<const SearchGrid<Dim>> Fields<Dim>::search_grid(
    const FieldOptions& options, std::optional<double> sigma_mm,
    const std::optional<BoxCorners<Dim>>& box_mm) {
  if (search_ && search_->options == options && search_->sigma_mm == sigma_mm &&
      search_->box_mm == box_mm)
    return search_->grid;
  search_.reset();
  shrink();
  search_.emplace(SearchEntry{options, sigma_mm, box_mm,
                              std::make_shared<const SearchGrid<Dim>>(segment::search_grid<Dim>(
                                  *setting_, options, sigma_mm, box_mm))});
  return search_->grid;
}

template <int Dim>
std::size_t Fields<Dim>::memory_bytes() const {
  std::size_t out = search_ ? search_->grid->memory_bytes() : 0;
  for (const Entry& entry : models_) out += entry.model->memory_bytes();
  return out;
}

template <int Dim>
void Fields<Dim>::shrink() {
  for (auto entry = models_.end(); entry != models_.begin() && memory_bytes() > max_bytes_;) {
    --entry;
    if (entry->model.use_count() == 1) entry = models_.erase(entry);
  }
  if (memory_bytes() > max_bytes_) search_.reset();
}

template <int Dim>
bool has_same_grid(const Options<Dim>& a, const Options<Dim>& b) {
  return a.sigma_mm == b.sigma_mm && a.box_mm == b.box_mm &&
         field_options(a, 0) == field_options(b, 0);
}

template bool has_same_grid<2>(const Options<2>&, const Options<2>&);
template bool has_same_grid<3>(const Options<3>&, const Options<3>&);
template class Fields<2>;
template class Fields<3>;

}  // namespace surf::segment
