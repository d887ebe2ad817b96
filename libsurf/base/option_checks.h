// What is wrong with options.
#pragma once

#include <fmt/format.h>

#include <string>

namespace surf {

/// Checks one constraint after the other; the first that does not hold is told as
/// "Type::field = value violates constraint".
class OptionChecks {
 public:
  explicit OptionChecks(const char* type) : type_(type) {}

  void require(bool holds, const char* field, double value, const char* constraint) {
    if (!holds && error_.empty())
      error_ = fmt::format("{}::{} = {} violates {}", type_, field, value, constraint);
  }

  /// Empty if all hold.
  const std::string& error() const { return error_; }

 private:
  const char* type_;
  std::string error_;
};

}  // namespace surf
