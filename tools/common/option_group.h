// Options of one group of the help text.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace surfseg {

class OptionGroup {
 public:
  /// @param command  is kept
  OptionGroup(CLI::App& command, std::string name) : command_(command), name_(std::move(name)) {}

  const std::string& name() const { return name_; }

  template <class T>
  CLI::Option* add(const std::string& option, T& value, const std::string& description) const {
    return command_.add_option(option, value, description)->group(name_);
  }
  /// The help says what `value` holds already.
  template <class T>
  CLI::Option* add_with_default(const std::string& option, T& value,
                                const std::string& description) const {
    return add(option, value, description)->capture_default_str();
  }
  /// One of a few words, `value` by default.
  CLI::Option* add_choice(const std::string& option, std::string& value,
                          const std::string& description,
                          const std::vector<std::string>& choices) const {
    return add_with_default(option, value, description)->check(CLI::IsMember(choices));
  }
  /// May be given again and again, with one value each time.
  CLI::Option* add_repeatable(const std::string& option, std::vector<std::string>& values,
                              const std::string& description) const {
    return add(option, values, description)->take_all()->allow_extra_args(false);
  }
  CLI::Option* add_flag(const std::string& option, bool& value,
                        const std::string& description) const {
    return command_.add_flag(option, value, description)->group(name_);
  }

 private:
  CLI::App& command_;
  std::string name_;
};

}  // namespace surfseg
