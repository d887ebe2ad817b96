// The program as a process: its arguments, what it prints, its exit code; a folder for its files.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
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

  Outcome run(const std::vector<std::string>& arguments) const {
    const int err = written(path("err"));
    const pid_t child = start(arguments, err);
    ::close(err);
    const int status = end_of(child);
    return {exit_code(status), read(path("out")), read(path("err"))};
  }

  /// Sends a signal at the first line of stderr that has `at`. The pipe holds one line, so that the
  /// program waits with the second line after that one until the signal is sent, however slow
  /// either of the two processes is.
  Outcome interrupted_run(const std::vector<std::string>& arguments, int signal,
                          const std::string& at) const {
    int err[2];
    if (::pipe2(err, O_CLOEXEC | O_DIRECT) != 0 || ::fcntl(err[1], F_SETPIPE_SZ, 1) < 0)
      throw std::system_error(errno, std::generic_category(), "a pipe of one line");
    const pid_t child = start(arguments, err[1]);
    ::close(err[1]);
    std::string text;
    std::array<char, 4096> line;
    const auto limit = std::chrono::steady_clock::now() + kTimeLimit;
    for (bool is_sent = false;;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          limit - std::chrono::steady_clock::now());
      pollfd readable = {err[0], POLLIN, 0};
      if (::poll(&readable, 1, std::max(0, int(left.count()))) <= 0) break;
      const ssize_t n = ::read(err[0], line.data(), line.size());
      if (n <= 0) break;
      text.append(line.data(), n);
      if (is_sent || text.find(at) == std::string::npos) continue;
      ::kill(child, signal);
      is_sent = true;
    }
    const int status = end_of(child, limit);
    ::close(err[0]);
    return {exit_code(status), read(path("out")), text};
  }

  /// Runs and expects success.
  Outcome must(const std::vector<std::string>& arguments) const {
    Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments.front() << ": " << outcome.err;
    return outcome;
  }

 private:
  using Time = std::chrono::steady_clock::time_point;

  static int exit_code(int status) {
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  static int written(const std::string& name) {
    return ::open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  }

  /// The status with which a child ends; one that takes longer than allowed is killed.
  static int end_of(pid_t child, Time limit = std::chrono::steady_clock::now() + kTimeLimit) {
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      if (std::chrono::steady_clock::now() > limit) {
        ADD_FAILURE() << "the program ran for more than " << kTimeLimit.count() << " s";
        ::kill(child, SIGKILL);
        ::waitpid(child, &status, 0);
        break;
      }
    }
    return status;
  }

  pid_t start(const std::vector<std::string>& arguments, int err) const {
    std::vector<std::string> words = {SURFSEG_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string folder = path("files");
    const int out = written(path("out"));
    const pid_t child = ::fork();
    if (child == 0) {
      if (::chdir(folder.c_str()) != 0 || ::dup2(out, 1) < 0 || ::dup2(err, 2) < 0) ::_exit(126);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    ::close(out);
    return child;
  }
};

}  // namespace surfseg::test
