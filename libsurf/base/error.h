// Exceptions of the library. main() maps each to a documented exit code.
#pragma once

#include <stdexcept>
#include <string>

namespace surf {

/// Base of all of surfseg's own exceptions. The message is one line: what, where,
/// what came, what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An option or argument is wrong (exit code 2).
class UsageError : public Error {
 public:
  using Error::Error;
};

/// An input file is missing, broken, or not of a kind that can be used (exit code 3).
class InputError : public Error {
 public:
  using Error::Error;
};

/// An output file cannot be written (exit code 4).
class OutputError : public Error {
 public:
  using Error::Error;
};

/// A surface breaks a guarantee: open, non-manifold, intersecting (exit code 6).
class InvalidMesh : public Error {
 public:
  using Error::Error;
};

/// No object stands out where one was looked for, or it vanished: there is nothing to write (exit
/// code 8).
class NoObject : public Error {
 public:
  using Error::Error;
};

}  // namespace surf
