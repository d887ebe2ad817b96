#include "tools/common/checkpoint.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "tools/common/arguments.h"
#include "tools/common/report.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;

constexpr const char* kKind = "surfseg checkpoint";

std::string hash(const std::string& text) {
  surf::ContentHash out;
  out.add_bytes(text);
  return out.digits();
}

/// By how it begins; Checkpoint::keep() writes it so.
bool is_checkpoint(const std::string& path) {
  const std::string begin = fmt::format("{{\"kind\": \"{}\"", kKind);
  std::string there(begin.size(), '\0');
  std::ifstream(path, std::ios::binary).read(there.data(), std::streamsize(there.size()));
  return there == begin;
}

}  // namespace

Checkpoint::Checkpoint(const std::string& argument, bool resumes) : resumes_(resumes) {
  if (argument.empty() && resumes)
    throw surf::UsageError("--resume: from what? Add the --checkpoint FILE of the run that ended");
  const std::size_t comma = argument.rfind(',');
  path_ = argument.substr(0, comma);
  if (comma == std::string::npos) return;
  least_seconds_ = parse_number("--checkpoint", argument.substr(comma + 1));
  if (!(least_seconds_ >= 0) || path_.empty())
    throw surf::UsageError(
        fmt::format("--checkpoint: expected FILE or FILE,SECONDS; got '{}'", argument));
}

void Checkpoint::begin(const std::function<std::string()>& asked) {
  if (path_.empty()) return;
  asked_ = hash(asked() + "\n" + SURFSEG_VERSION);
  if (!std::filesystem::exists(path_)) return;
  if (!resumes_) {
    if (!is_checkpoint(path_))
      throw surf::UsageError(fmt::format(
          "--checkpoint: {} is there and not a {}, which it would be written over by; give "
          "another name",
          path_, kKind));
    return;
  }
  const ordered_json file = read_json(path_);
  try {
    if (!file.is_object() || file.value("kind", "") != kKind)
      throw surf::InputError(fmt::format("{}: not a {}", path_, kKind));
    if (file.at("asked") != asked_)
      throw surf::InputError(fmt::format(
          "{}: a checkpoint of another image, other clicks or options, or another version of the "
          "program; give those of the run that ended, or begin without --resume",
          path_));
    for (const ordered_json& state : file.at("states"))
      states_.push_back(state.is_null() ? "" : state.dump());
  } catch (const ordered_json::exception& error) {
    throw surf::InputError(fmt::format("{}: damaged: {}", path_, error.what()));
  }
}

surf::segment::Checkpointing Checkpoint::of(std::size_t n) {
  if (path_.empty()) return {};
  if (states_.size() <= n) states_.resize(n + 1);
  return {[this, n](const std::string& state) { keep(n, state); }, states_[n]};
}

void Checkpoint::keep(std::size_t n, const std::string& state) {
  states_[n] = state;
  const auto now = std::chrono::steady_clock::now();
  const bool is_first = written_ == std::chrono::steady_clock::time_point();
  if (!is_first && std::chrono::duration<double>(now - written_).count() < least_seconds_) return;
  std::string text =
      fmt::format("{{\"kind\": \"{}\", \"asked\": \"{}\", \"states\": [\n", kKind, asked_);
  for (std::size_t i = 0; i < states_.size(); ++i)
    text += (states_[i].empty() ? "null" : states_[i]) + (i + 1 < states_.size() ? ",\n" : "\n");
  surf::write_bytes(path_, text + "]}\n");
  written_ = std::chrono::steady_clock::now();
}

void Checkpoint::remove() const {
  std::error_code status;
  if (!path_.empty()) std::filesystem::remove(path_, status);
}

}  // namespace surfseg
