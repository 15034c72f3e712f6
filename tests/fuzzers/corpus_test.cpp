// What the fuzzers start from, and what they found, without libFuzzer: every file of corpus/NAME/ and a few spoiled
// copies of each go through the target NAME. Anything that it throws fails the test, and so does a minute.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <random>

#include "problems/input_text.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {
namespace {

namespace fs = std::filesystem;

struct Target {
  std::string name;
  void (*read)(const std::string&);
  std::vector<std::string> more;  ///< folders of good files
};

void PrintTo(const Target& target, std::ostream* out) {
  *out << target.name;
}

const std::string kSource = RICOCHET_TEST_DATA "/../..";

std::vector<std::string> texts_of(const Target& target) {
  std::vector<std::string> folders = {kSource + "/tests/fuzzers/corpus/" + target.name}, texts;
  for (const auto& folder : target.more) folders.push_back(kSource + "/" + folder);
  for (const auto& folder : folders) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.is_regular_file() && entry.file_size() < 10000)
        texts.push_back(read_input_text(entry.path(), "corpus"));
    }
  }
  return texts;
}

/// One byte changed, a piece left out, or a piece said twice.
std::string spoiled(std::string text, std::mt19937& random) {
  if (text.empty()) return "{";
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  const std::size_t at = below(text.size()), n = 1 + below(8);
  switch (below(3)) {
    case 0:
      text[at] = static_cast<char>(below(256));
      break;
    case 1:
      text.erase(at, n);
      break;
    default:
      text.insert(at, text.substr(at, n));
  }
  return text;
}

class Corpus : public testing::TestWithParam<Target> {};

TEST_P(Corpus, EveryTextIsReadOrRefused) {
  constexpr int kSpoiled = 20;
  std::mt19937 random(16);
  const auto texts = texts_of(GetParam());
  EXPECT_GE(texts.size(), 3u);
  for (const auto& text : texts) {
    EXPECT_NO_THROW(GetParam().read(text)) << text;
    for (int k = 0; k < kSpoiled; ++k) {
      const std::string bad = spoiled(text, random);
      EXPECT_NO_THROW(GetParam().read(bad)) << bad;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, Corpus,
                         testing::Values(Target{"formula", formula, {}}, Target{"scene", scene, {"tests/data"}},
                                         Target{"method_spec", method_spec, {}},
                                         Target{"tableau", tableau, {"tests/data"}}, Target{"results", results, {}},
                                         Target{"baseline", baseline, {}},
                                         Target{"experiment", experiment, {"bench/experiments"}},
                                         Target{"ensemble", ensemble, {}}),
                         [](const auto& target) { return target.param.name; });

}  // namespace
}  // namespace ricochet::fuzzing
