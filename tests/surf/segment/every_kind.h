// What holds for every energy kind of the table, in either dimension.
#pragma once

#include "libsurf/segment/energy_assembly.h"
#include "tests/surf/energy/energies.h"

namespace surf::test {

/// The term with all its defaults.
template <int Dim>
segment::EnergyTerm complete_term(const segment::EnergyKind<Dim>& kind,
                                  const segment::KindContext<Dim>& context) {
  segment::EnergyTerm term{kind.name, 1, {}};
  return segment::completed<Dim>(std::move(term), context);
}

/// Builds every kind with its defaults and holds dJ against differences on the shape.
/// @param tolerance  of the sum of |derivative|
template <int Dim>
void expect_derivatives_of_every_kind(const segment::KindContext<Dim>& context,
                                      const Simplices<Dim>& start, double step, double tolerance) {
  const fem::Geometry<Dim> shape(start.points, start.elements);
  const Points<Dim> W = random_smooth_vectors<Dim>(start.points, 7);
  for (const segment::EnergyKind<Dim>* kind : segment::all_kinds<Dim>()) {
    const std::vector terms = {complete_term(*kind, context)};
    const auto energy = segment::make_energy<Dim>(terms, context);
    energy->reset(shape);
    energy::ShapeTerms<Dim> derivative(shape);
    energy->differentiate(no_curvature(shape.n_vertices()), 1, derivative);
    const double exact = derivative.derivative.cwiseProduct(W).sum();
    const double difference = first_difference<Dim>(*energy, shape, W, step);
    const double scale = derivative.derivative.cwiseProduct(W).cwiseAbs().sum();
    EXPECT_NEAR(exact, difference, tolerance * scale) << to_string(terms[0]);
  }
}

/// Values just outside and at the ends of every parameter's range.
template <int Dim>
void expect_ranges_of_every_kind() {
  using segment::EnergyTerm;
  const auto refused = [](const EnergyTerm& term) -> std::string {
    try {
      segment::check_terms<Dim>(std::vector{term});
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  for (const segment::EnergyKind<Dim>* kind : segment::all_kinds<Dim>())
    for (const auto& parameter : kind->parameters) {
      const auto expect_refused = [&](double value) {
        const std::string message = refused({kind->name, 1, {{parameter.key, value}}});
        EXPECT_NE(message.find("energy " + kind->name + ": " + parameter.key), std::string::npos)
            << kind->name << " " << parameter.key << " " << value << ": " << message;
      };
      expect_refused(std::nan(""));
      expect_refused(INFINITY);
      if (std::isfinite(parameter.range.lowest)) expect_refused(parameter.range.lowest - 1e-9);
      if (parameter.range.excludes_lowest) expect_refused(parameter.range.lowest);
      if (!parameter.range.values.empty()) expect_refused(parameter.range.values.front() + 0.5);
      for (const double value : parameter.range.values)
        EXPECT_EQ(refused({kind->name, 1, {{parameter.key, value}}}), "");
      const auto last = EnergyTerm{kind->name, 1, {{parameter.key, 1}}};
      EXPECT_EQ(refused(last), "");
    }
}

}  // namespace surf::test
