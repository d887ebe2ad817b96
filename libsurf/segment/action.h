// What may be done to an object: the entries of its history and of a recipe.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "libsurf/segment/click.h"
#include "libsurf/segment/options.h"

namespace surf::segment {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

template <int Dim>
struct AddClick {
  Click<Dim> click;
};
struct TakeBackClick {
  std::size_t index;  ///< of the clicks, in their order
};
template <int Dim>
struct SetOptions {
  Options<Dim> options;
};
template <int Dim>
struct Propose {
  /// The inside clicks that the other objects had then, as outside clicks: no matter what has been
  /// done to them since, it is repeated with these.
  std::vector<Click<Dim>> others = {};
};
struct Choose {
  std::size_t proposal;
};
template <int Dim>
struct Evolve {
  /// The call of the progress that asked it to stop, from 1: repeated there. None = to its end.
  std::optional<int> stopped_at = {};
  std::vector<Click<Dim>> others = {};  ///< as in Propose
  /// It went on from nothing before it: clicks, options and others say all of it.
  bool is_anew = false;
};
struct Rename {
  std::string name;
};
struct Recolour {
  Colour colour;
};

template <int Dim>
using Action = std::variant<AddClick<Dim>, TakeBackClick, SetOptions<Dim>, Propose<Dim>, Choose,
                            Evolve<Dim>, Rename, Recolour>;

/// Whether an entry of the history was set off by another, and is no act of a person.
template <int Dim>
bool is_consequence(const Action<Dim>& action) {
  return std::holds_alternative<Evolve<Dim>>(action) ||
         std::holds_alternative<Propose<Dim>>(action);
}

/// Whether it changes no more than how an object is named and drawn.
template <int Dim>
bool is_look(const Action<Dim>& action) {
  return std::holds_alternative<Rename>(action) || std::holds_alternative<Recolour>(action);
}

/// Whether something was done last that no evolution has heeded: a click, options, a choice.
template <int Dim>
bool awaits_evolution(const std::vector<Action<Dim>>& history) {
  const auto last = std::find_if_not(history.rbegin(), history.rend(), is_look<Dim>);
  return last != history.rend() && !is_consequence<Dim>(*last);
}

}  // namespace surf::segment
