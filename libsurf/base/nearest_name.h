// What a mistyped name was meant to be.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace surf {

/// The name next to `word`: fewest letters added, left out, changed or swapped with their
/// neighbour, at most one in three; else the first name that begins with `word`. The first of
/// equals.
std::optional<std::string> nearest_name(const std::string& word,
                                        std::span<const std::string> names);

/// "; did you mean 'radius'?", or nothing where no name is near.
std::string did_you_mean(const std::string& word, std::span<const std::string> names);

}  // namespace surf
