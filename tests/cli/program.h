// The program as a process: its arguments, what it prints, its exit code; a folder for its files.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/surf/io/scratch_folder.h"

namespace surfseg::test {

struct Outcome {
  int exit_code = -1;  ///< 128 + signal if a signal ended the process
  std::string out, err;
};

/// Runs the program in a scratch folder, so that file names in arguments need no folder.
class Program : public surf::test::ScratchFolder {
 protected:
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  static constexpr auto kTimeLimit = std::chrono::seconds(1800);
#else
  static constexpr auto kTimeLimit = std::chrono::seconds(240);
#endif

  Program() { std::filesystem::create_directories(path("files")); }

  /// A file in the program's working folder.
  std::string file(const std::string& name) const { return path("files/" + name); }
  std::string bytes(const std::string& name) const { return read(file(name)); }
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(bytes(name)); }
  bool exists(const std::string& name) const { return std::filesystem::exists(file(name)); }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path("files")))
      names.push_back(entry.path().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  /// @param signal  sent once when the program has printed `after` on stderr; 0 = none
  Outcome run(const std::vector<std::string>& arguments, int signal = 0,
              const std::string& after = {}) const {
    const pid_t child = start(arguments);
    const auto limit = std::chrono::steady_clock::now() + kTimeLimit;
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      if (signal && read(path("err")).find(after) != std::string::npos) {
        ::kill(child, signal);
        signal = 0;
      }
      if (std::chrono::steady_clock::now() > limit) {
        ADD_FAILURE() << "the program ran for more than " << kTimeLimit.count() << " s";
        ::kill(child, SIGKILL);
        ::waitpid(child, &status, 0);
        break;
      }
    }
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read(path("out")),
            read(path("err"))};
  }

  /// Runs and expects success.
  Outcome must(const std::vector<std::string>& arguments) const {
    Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments.front() << ": " << outcome.err;
    return outcome;
  }

 private:
  pid_t start(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words = {SURFSEG_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string folder = path("files");
    const int out = ::open(path("out").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const int err = ::open(path("err").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const pid_t child = ::fork();
    if (child == 0) {
      if (::chdir(folder.c_str()) != 0 || ::dup2(out, 1) < 0 || ::dup2(err, 2) < 0) ::_exit(126);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    ::close(out);
    ::close(err);
    return child;
  }
};

}  // namespace surfseg::test
