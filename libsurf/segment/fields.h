// What is computed from an image once, and kept for further clicks and objects.
#pragma once

#include <list>
#include <memory>
#include <optional>

#include "libsurf/segment/object_box.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

/// Models (smoothed intensities, edge indicators) and the search grid of one image, made when they
/// are first asked for. Models that are not in use are dropped, the least recently used first, when
/// all together hold more than the bound; what is dropped is made again, the same to the bit. The
/// search grid costs most to make and is dropped last; who has it keeps it. Not thread-safe.
template <int Dim>
class Fields {
 public:
  /// @param setting  kept
  explicit Fields(std::shared_ptr<const Setting<Dim>> setting, std::size_t max_bytes = 1 << 30);

  const Setting<Dim>& setting() const { return *setting_; }
  std::shared_ptr<EnergyModel<Dim>> model(const FieldOptions& options);
  /// For the search; `options` as given by the user, sigma only if it was.
  std::shared_ptr<const SearchGrid<Dim>> search_grid(
      const FieldOptions& options, std::optional<double> sigma_mm,
      const std::optional<BoxCorners<Dim>>& box_mm = {});
  std::size_t memory_bytes() const;
  /// Drops what the bound asks for.
  void shrink();

 private:
  struct Entry {
    FieldOptions options;
    std::shared_ptr<EnergyModel<Dim>> model;
  };
  struct SearchEntry {
    FieldOptions options;
    std::optional<double> sigma_mm;
    std::optional<BoxCorners<Dim>> box_mm;
    std::shared_ptr<const SearchGrid<Dim>> grid;
  };

  std::shared_ptr<const Setting<Dim>> setting_;
  std::size_t max_bytes_;
  std::list<Entry> models_;  ///< the most recently used first
  std::optional<SearchEntry> search_;
};

/// Whether both look for objects on the same grid.
template <int Dim>
bool has_same_grid(const Options<Dim>& a, const Options<Dim>& b);

}  // namespace surf::segment
