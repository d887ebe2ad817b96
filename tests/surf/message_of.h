// What errors say.
#pragma once

#include <string>

namespace surf::test {

/// The message of the Error that the call throws, or "accepted".
template <class Error, class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace surf::test
