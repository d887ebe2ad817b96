#include <cstdio>

#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/segment/energy_kind.h"
#include "libsurf/segment/finish.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/read_volume.h"

using namespace surf;
using namespace surf::segment;

int main(int, char** argv) {
  EnergyKind<3> bright{.name = "brighter-than-half"};  // int_Omega (1/2 - I) dx
  bright.build = [](const KindContext<3>& context, const EnergyTerm&) {
    const auto darkness = energy::mapped_field<3>(context.model.intensity(), [](double I) {
      return std::array{0.5 - I, -1.0, 0.0};
    });
    return std::make_unique<energy::DomainIntegral<3>>(darkness, energy::DomainIntegralOptions{});
  };
  register_kind(bright);

  Segmentation<3> dialogue(make_setting(volume::read_volume(argv[1])));
  const int ball = dialogue.add_object("ball");
  dialogue.add_click(ball, {{0, 0, 0}, Side::kInside});
  dialogue.evolve(ball, [](const std::string& stage, const flow::StepRecord& step, const auto&) {
    return std::printf("%s %d\n", stage.c_str(), step.k) > 0;  // false would stop it
  });
  dialogue.add_click(ball, {{4, 0, 0}, Side::kInside});
  dialogue.evolve(ball);
  dialogue.undo(ball);
  Options<3> options;
  options.energies = {parse_term("brighter-than-half"), parse_term("area:weight=0.1")};
  dialogue.set_options(ball, options);
  dialogue.evolve(ball);
  write(argv[2], finish<3>(dialogue.setting(), *dialogue.object(ball).result, ".stl"), {});
}
