// surfseg studio: click in a browser, see the surface, mend it, take it home.
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "libsurf/base/error.h"
#include "tools/common/say.h"
#include "tools/common/signals.h"
#include "tools/studio/dialogue.h"
#include "tools/studio/folder.h"
#include "tools/studio/server.h"
#include "tools/surfseg/commands.h"

namespace surfseg {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    "Without an argument the page lists what can be opened in the current folder. What is done is\n"
    "kept beside the scan as SCAN.surfseg.json after every click: the studio opens where it was, "
    "and\n"
    "`surfseg replay` repeats it. Nothing outside the folder is read or written.\n\n"
    "On another machine: surfseg studio --no-open --port 8911 there, and here\n"
    "ssh -N -L 8911:127.0.0.1:8911 THERE; then open the address that it printed.\n\n"
    "Examples:\n"
    "  surfseg studio ct.nii.gz\n"
    "  surfseg studio --no-open --port 8911 scans/";

struct Arguments {
  std::string path = ".";
  int port = 0;
  bool is_closed = false, has_itksnap = false;
  bool has_path = false;
};

void tell_without_browser() {
  say("surfseg studio: no browser could be opened (xdg-open): open the address in one\n");
}

/// Without a shell; what it says goes nowhere. In a session of its own: the terminal's Ctrl-C is
/// for the studio, not for a browser that was not running before.
void open_browser(const std::string& address) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  std::string name = "xdg-open", argument = address;
  char* words[] = {name.data(), argument.data(), nullptr};
  pid_t child = 0;
  if (posix_spawnp(&child, "xdg-open", &actions, &attributes, words, environ) != 0)
    tell_without_browser();
  else
    std::thread([child] {
      int status = 0;
      if (waitpid(child, &status, 0) == child && status != 0) tell_without_browser();
    }).detach();
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
}

void run(const Arguments& arguments, ExitCode& exit_code) {
  const fs::path path = fs::absolute(arguments.path).lexically_normal();
  if (!fs::exists(path))
    throw surf::InputError(arguments.path + ": there is no such file or folder");
  const bool is_list = fs::is_directory(path) && !studio::is_dicom_folder(path);
  const fs::path clean = path.has_filename() ? path : path.parent_path();
  const fs::path folder = is_list ? clean : clean.parent_path();
  if (is_list && studio::entries_of(folder).empty()) {
    const std::string why = "holds no volume, DICOM folder or recipe that could be opened";
    if (arguments.has_path) throw surf::InputError(arguments.path + ": " + why);
    // A menu names none.
    say("surfseg studio: {} {}; give another folder or a file\n", folder.string(), why);
  }
  studio::Dialogue dialogue(folder);
  studio::Server server(dialogue, arguments.port, SURFSEG_VERSION, arguments.has_itksnap);
  if (!is_list) dialogue.open(clean);
  catch_signals();
  std::atomic<bool> is_done = false;
  std::thread watch([&] {
    while (!is_done && signal_exit_code() == kDone)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    server.stop();
  });
  fmt::print("{}\n", server.address());
  std::fflush(stdout);
  say("surfseg studio: open this address in a browser; Ctrl-C ends it\n");
  if (!arguments.is_closed) open_browser(server.launch_address());
  server.run();
  is_done = true;
  watch.join();
  exit_code = signal_exit_code();
}

}  // namespace

void add_studio_command(CLI::App& app, ExitCode& exit_code) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("studio", "Click in a browser, see the surface, mend it, take it home.");
  CLI::Option* path =
      command
          ->add_option("PATH", arguments->path, "A volume, a DICOM folder, a recipe, or a folder")
          ->capture_default_str();
  command->add_option("--port", arguments->port, "Port on 127.0.0.1 [any that is free]")
      ->check(CLI::Range(1, 65535));
  command->add_flag("--no-open", arguments->is_closed, "Print the address, open no browser");
  command->add_flag(
      "--itksnap", arguments->has_itksnap,
      "Answer ITK-SNAP's deep-learning client too (127.0.0.1 and the port), which has "
      "no token: any program of this machine may ask");
  command->footer(kFooter);
  command->callback([arguments, path, &exit_code] {
    arguments->has_path = path->count() > 0;
    run(*arguments, exit_code);
  });
}

}  // namespace surfseg
