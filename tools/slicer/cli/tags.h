// Progress on stdout in tags that Slicer and MITK show in their windows.
#pragma once

#include <chrono>
#include <string>

namespace surfseg::slicer {

/// Each line is flushed at once. Nothing is printed if it is not wanted.
class Tags {
 public:
  explicit Tags(bool are_wanted) : are_wanted_(are_wanted) {}

  void start(const std::string& comment);
  /// How much there is to do is not known: the share rises with each step, and never reaches 1. At
  /// most ten a second are printed.
  void step(const std::string& comment);
  /// What MITK reads in place of the file of --returnparameterfile.
  void result(const std::string& name, const std::string& value);
  void end();

 private:
  void print(const std::string& text) const;

  bool are_wanted_;
  int n_steps_ = 0;
  std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace surfseg::slicer
