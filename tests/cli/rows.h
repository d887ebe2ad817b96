// What is wrong on a command line, as rows: its exit code and a piece of the one line that says so.
#pragma once

#include "tests/cli/program.h"

namespace surfseg::test {

using Words = std::vector<std::string>;

inline Words joined(Words first, const Words& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

struct Row {
  const char* test;
  Words arguments;
  int exit_code;
  const char* piece;  ///< of the message
};
inline void PrintTo(const Row& row, std::ostream* stream) { *stream << row.test; }

/// With files of its own to put.
class FileTest : public Program {
 protected:
  void put(const std::string& name, const std::string& content) const {
    write("files/" + name, content);
  }
};

class RowTest : public FileTest, public ::testing::WithParamInterface<Row> {
 protected:
  /// One line on stderr, nothing on stdout, and no file.
  void expect_refusal(const std::string& program) const {
    const auto before = files();
    const Outcome outcome = run(GetParam().arguments);
    EXPECT_EQ(outcome.exit_code, GetParam().exit_code) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(program + ": error: ")) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_TRUE(outcome.err.ends_with('\n')) << outcome.err;
    EXPECT_LT(outcome.err.size(), 500u) << outcome.err;
    EXPECT_NE(outcome.err.find(GetParam().piece), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(files(), before);
  }
};

inline std::string name_of(const ::testing::TestParamInfo<Row>& info) { return info.param.test; }

}  // namespace surfseg::test
