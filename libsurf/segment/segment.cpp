#include "libsurf/segment/segment.h"

#include "libsurf/segment/detail/surface_setting.h"

namespace surf::segment {

std::shared_ptr<const Setting<3>> make_setting(const volume::Volume& volume) {
  return std::make_shared<const SurfaceSetting>(volume);
}

template <int Dim>
std::vector<Click<Dim>> clicks_of(const Options<Dim>& options) {
  std::vector<Click<Dim>> out;
  auto seed = options.seeds_mm.begin(), point = options.outside_mm.begin();
  for (const Side side : options.click_order) {
    auto& next = side == Side::kInside ? seed : point;
    if (next != (side == Side::kInside ? options.seeds_mm : options.outside_mm).end())
      out.push_back({*next++, side});
  }
  for (; seed != options.seeds_mm.end(); ++seed) out.push_back({*seed, Side::kInside});
  for (; point != options.outside_mm.end(); ++point) out.push_back({*point, Side::kOutside});
  return out;
}

template <int Dim>
Result<Dim> segment(std::shared_ptr<const Setting<Dim>> setting, const Options<Dim>& options,
                    const ProgressOf<Dim>& progress, const std::stop_token& stop) {
  Segmentation<Dim> segmentation(std::move(setting));
  const int object = segmentation.add_object();
  segmentation.set_options(object, options);
  for (const Click<Dim>& click : clicks_of(options)) segmentation.add_click(object, click);
  return segmentation.evolve(object, progress, stop);
}

template std::vector<Click<2>> clicks_of<2>(const Options<2>&);
template std::vector<Click<3>> clicks_of<3>(const Options<3>&);
template Result<2> segment<2>(std::shared_ptr<const Setting<2>>, const Options<2>&,
                              const ProgressOf<2>&, const std::stop_token&);
template Result<3> segment<3>(std::shared_ptr<const Setting<3>>, const Options<3>&,
                              const ProgressOf<3>&, const std::stop_token&);

}  // namespace surf::segment
