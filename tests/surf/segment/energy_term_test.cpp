// Terms as text.
#include "libsurf/segment/energy_term.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "libsurf/base/error.h"
#include "tests/surf/message_of.h"

namespace surf::segment {
namespace {

std::string message(const std::string& text) {
  return test::message_of<UsageError>([&] { parse_term(text); });
}

TEST(EnergyTermText, IsNameAndParametersAndWeight) {
  const EnergyTerm expected{"window", 2, {{"mean", 380}, {"half-width", 150}}};
  EXPECT_EQ(parse_term("window:mean=380,half-width=150,weight=2"), expected);
  EXPECT_EQ(to_string(expected), "window:half-width=150,mean=380,weight=2");
  EXPECT_EQ(parse_term("area"), (EnergyTerm{"area", 1, {}}));
  EXPECT_EQ(to_string({"area", 1, {}}), "area");
}

TEST(EnergyTermText, RoundTripsToTheBit) {
  std::mt19937_64 generator(3);
  std::vector<double> values = {0.1,    -0.0,   1e300, std::numeric_limits<double>::denorm_min(),
                                1e-300, 1e16,   3,     std::numeric_limits<double>::max(),
                                -2.5,   1.0 / 3};
  while (values.size() < 1000) {
    const double value = std::bit_cast<double>(generator());
    if (std::isfinite(value)) values.push_back(value);
  }
  for (const double value : values) {
    const EnergyTerm term{"own", value, {{"a", value}, {"b-c", 1 / 3.0}}};
    const EnergyTerm again = parse_term(to_string(term));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(again.weight), std::bit_cast<std::uint64_t>(value));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(again.parameters.at("a")),
              std::bit_cast<std::uint64_t>(value));
    EXPECT_EQ(to_string(again), to_string(term));
  }
}

TEST(EnergyTermText, IsRefusedWithTheKindsName) {
  EXPECT_EQ(message("window:mean"), "energy window: expected key=value; got 'mean'");
  EXPECT_EQ(message("window:mean=x"), "energy window: mean: expected a number; got 'x'");
  EXPECT_EQ(message("window:mean=inf"), "energy window: mean: expected a number; got 'inf'");
  EXPECT_EQ(message("window:mean=1 "), "energy window: mean: expected a number; got '1 '");
  EXPECT_EQ(message("window:mean=1,mean=2"), "energy window: mean is given twice");
  EXPECT_EQ(message("window:weight=1,weight=1"), "energy window: weight is given twice");
}

TEST(EnergyTermText, MissingParametersAreNamed) {
  const EnergyTerm term{"window", 1, {{"mean", 2}}};
  EXPECT_EQ(parameter(term, "mean"), 2);
  EXPECT_THROW(parameter(term, "half-width"), UsageError);
}

}  // namespace
}  // namespace surf::segment
