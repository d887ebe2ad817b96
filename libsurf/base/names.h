#pragma once

#include <cassert>
#include <initializer_list>
#include <optional>
#include <string_view>

namespace surf {

/// A value of an enum and what it is called in files, tables and messages.
template <class Enum>
struct Named {
  Enum value;
  const char* name;
};

template <class Enum>
using Names = std::initializer_list<Named<Enum>>;

/// What `value` is called; all values have to be among `names`.
template <class Enum>
constexpr const char* name_of(Enum value, Names<Enum> names) {
  for (const Named<Enum>& named : names)
    if (named.value == value) return named.name;
  assert(!"a value without a name");
  return "";
}

/// The value that is called `name`, if there is one.
template <class Enum>
constexpr std::optional<Enum> value_of(std::string_view name, Names<Enum> names) {
  for (const Named<Enum>& named : names)
    if (named.name == name) return named.value;
  return std::nullopt;
}

}  // namespace surf
