#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

// The program, called as a user calls it.

namespace ricochet::cli {

namespace fs = std::filesystem;

struct Outcome {
  int code;
  std::string text;  ///< stdout and stderr
};

inline Outcome run_command(const std::string& command) {
  FILE* pipe = popen(("(" + command + ") 2>&1").c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  while (std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) text.append(buffer.data(), n);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

inline Outcome run(const std::string& arguments) {
  return run_command(std::string(RICOCHET_PROGRAM) + " " + arguments);
}

inline std::string test_data(const std::string& name) {
  return std::string(RICOCHET_TEST_DATA) + "/" + name;
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

/// With a folder that goes away with its files.
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

}  // namespace ricochet::cli

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)
