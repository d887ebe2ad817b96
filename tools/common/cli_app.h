// The class of CLI11 that options are added to, by name: each source that includes its header
// compiles the checks that it defines for whoever includes it (5 s with CLI/CLI.hpp, 2 s with
// CLI/App.hpp; 0.2 s without).
#pragma once

namespace CLI {  // NOLINT(readability-identifier-naming): its own
class App;
class Option;
}  // namespace CLI
