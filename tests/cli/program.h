#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

// The program as a user meets it, for the tests of this folder.

namespace ricochet::cli {

namespace fs = std::filesystem;

struct Outcome {
  int code;
  std::string text;  ///< what was printed
};

/// @param command  of the shell
inline Outcome output_of(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  while (std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) text.append(buffer.data(), n);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

/// With what went to stderr.
inline Outcome run_command(const std::string& command) {
  return output_of("(" + command + ") 2>&1");
}

inline Outcome run(const std::string& arguments) {
  return run_command(std::string(RICOCHET_PROGRAM) + " " + arguments);
}

inline std::string test_data(const std::string& name) {
  return std::string(RICOCHET_TEST_DATA) + "/" + name;
}

inline std::string reference_data(const std::string& name) {
  return test_data("../../reference/data/" + name);
}

inline std::string read(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Results without the minute at which they were begun.
inline std::string undated(const std::string& results) {
  return std::regex_replace(results, std::regex(R"("date":"[^"]*")"), "");
}

/// A folder of its own for each test.
class Cli : public testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("ricochet_cli_" + std::to_string(getpid()));
  void SetUp() override { fs::create_directories(folder); }
  ~Cli() override { fs::remove_all(folder); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  }
};

/// An experiment of a second.
inline const char* const kExperiment = R"({
  "id": "small", "title": "a small experiment", "problem": "two_balls_spring",
  "methods": [
    {"method": "fesd:gauss:1", "steps": [80, 90], "on_failure": "fesd:gauss:1,elements=as_needed"},
    {"method": "fesd:gauss:3", "steps": [60, 75, 95, 120, 150, 190, 240, 300]},
    {"method": "cvode:adams", "tolerances": [1e-8]}
  ],
  "trajectory": {"method": "fesd:gauss:3", "steps": 50}
})";

}  // namespace ricochet::cli

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)
