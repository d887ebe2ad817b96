// The corpus, all that was ever found, and some thousand mutations: read or refused in one line,
// within the memory that the bytes bear out. The preset fuzz goes on from here (tools/fuzz.sh).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <random>

#include "tests/fuzz/targets.h"

namespace surf::fuzz {

/// In the names of tests, in place of addresses.
void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

constexpr double kMostSeconds = 10;  // of one file of some kB

std::vector<fs::path> files_in(const std::string& kind, const std::string& target) {
  std::vector<fs::path> out;
  const fs::path folder = fs::path(SURFSEG_FUZZ_FOLDER) / kind / target;
  if (fs::exists(folder))
    for (const auto& entry : fs::directory_iterator(folder)) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

Bytes bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

Reading timed_run(const Target& target, const Bytes& bytes, const std::string& what) {
  const auto begin = std::chrono::steady_clock::now();
  Reading out;
  try {
    out = run(target, bytes);
  } catch (const std::exception& error) {
    ADD_FAILURE() << what << ": " << error.what();
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  EXPECT_LT(seconds.count(), kMostSeconds) << what;
  return out;
}

/// One to four places with other bytes, some of them the ends of ranges; now and then a piece is
/// cut out or doubled.
Bytes mutated(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) {
    return std::size_t(random() % std::max<std::size_t>(n, 1));
  };
  constexpr std::uint8_t kEnds[] = {0x00, 0x01, 0x7f, 0x80, 0xff, '9', '-', ' '};
  for (std::size_t n = 1 + below(4); n > 0 && !bytes.empty(); --n) {
    const std::size_t at = below(bytes.size()), length = 1 + below(8);
    const auto begin = bytes.begin() + std::ptrdiff_t(at),
               end = begin + std::ptrdiff_t(std::min(length, bytes.size() - at));
    switch (below(6)) {
      case 0:
        std::fill(begin, end, kEnds[below(std::size(kEnds))]);
        break;
      case 1:
        *begin ^= std::uint8_t(1u << below(8));
        break;
      case 2:
        bytes.erase(begin, end);
        break;
      case 3: {
        const Bytes piece(begin, end);
        bytes.insert(begin, piece.begin(), piece.end());
        break;
      }
      case 4:
        if (below(4) == 0) bytes.resize(at);
        break;
      default:
        *begin = std::uint8_t(random());
    }
  }
  return bytes;
}

class Corpus : public ::testing::TestWithParam<Target> {};

TEST_P(Corpus, IsRead) {
  const auto files = files_in("corpus", GetParam().name);
  ASSERT_FALSE(files.empty());
  for (const fs::path& file : files) {
    const auto reading = timed_run(GetParam(), bytes_of(file), file.string());
    EXPECT_TRUE(reading.is_read) << file << ": " << reading.message;
  }
}

TEST_P(Corpus, WhatWasFoundOnceIsTakenInOneLine) {
  for (const fs::path& file : files_in("regressions", GetParam().name))
    timed_run(GetParam(), bytes_of(file), file.string());
}

TEST_P(Corpus, MutationsAreTakenInOneLine) {
  constexpr int kMutations = 150;  // of each file
  std::mt19937 random(20);         // NOLINT: the same in every run
  int n_refused = 0, n = 0;
  for (const fs::path& file : files_in("corpus", GetParam().name)) {
    const Bytes whole = bytes_of(file);
    for (int k = 0; k < kMutations; ++k, ++n)
      n_refused += !timed_run(GetParam(), mutated(whole, random),
                              fmt::format("{}, mutation {}", file.string(), k))
                        .is_read;
  }
  EXPECT_GT(n_refused, 0) << "of " << n;  // the mutations do reach the reader
}

std::string name_of(const ::testing::TestParamInfo<Target>& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

const std::vector<Target> kAll(targets().begin(), targets().end());
INSTANTIATE_TEST_SUITE_P(, Corpus, ::testing::ValuesIn(kAll), name_of);

}  // namespace
}  // namespace surf::fuzz
