#include "tools/slicer/cli/tags.h"

#include <fmt/format.h>

#include <cstdio>

#include "tools/common/stage_clock.h"
#include "tools/slicer/cli/description.h"

namespace surfseg::slicer {
namespace {

constexpr const char* kName = "<filter-name>surfseg</filter-name>";
constexpr std::chrono::milliseconds kBetween(100);
constexpr double kHalfOfSteps = 30;  // runs on the phantoms have 20 to 80

}  // namespace

void Tags::print(const std::string& text) const {
  if (!are_wanted_) return;
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

void Tags::start(const std::string& comment) {
  start_ = std::chrono::steady_clock::now();
  last_ = start_ - kBetween;  // the first step is shown however soon it comes
  print(fmt::format("<filter-start>{}<filter-comment>{}</filter-comment></filter-start>", kName,
                    xml_text(comment)));
  print("<filter-progress>0</filter-progress>");
}

void Tags::step(const std::string& comment) {
  ++n_steps_;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < kBetween) return;
  last_ = now;
  print(fmt::format("<filter-progress>{:.3f}</filter-progress>",
                    0.95 * n_steps_ / (n_steps_ + kHalfOfSteps)));
  print(fmt::format("<filter-comment>{}</filter-comment>", xml_text(comment)));
}

void Tags::result(const std::string& name, const std::string& value) {
  print(fmt::format("<filter-result name=\"{}\">{}</filter-result>", name, xml_text(value)));
}

void Tags::end() {
  print("<filter-progress>1</filter-progress>");
  print(fmt::format("<filter-end>{}<filter-time>{:.2f}</filter-time></filter-end>", kName,
                    seconds_since(start_)));
}

}  // namespace surfseg::slicer
