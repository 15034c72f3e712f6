#include "bench/measure/environment.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <ginac/version.h>
#include <gsl/gsl_version.h>
#include <sundials/sundials_config.h>

#include <Eigen/Core>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bench/plugin/load_plugins.h"
#include "git_revision.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string date() {
  const std::time_t now = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", std::gmtime(&now));
  return text;
}

}  // namespace

std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return fmt::format("{:016x}", hash);
}

std::string program_hash() {
  std::string text = read_text("/proc/self/exe");
  for (const auto& plugin : loaded_plugins()) text += hash_of(read_text(plugin));
  return hash_of(text);
}

std::string version_text() {
  return fmt::format("ricochet {}, revision {}", RICOCHET_VERSION, RICOCHET_GIT_REVISION);
}

nlohmann::json environment() {
  const std::string governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  return {{"revision", RICOCHET_GIT_REVISION},
          {"compiler", RICOCHET_COMPILER},
          {"flags", RICOCHET_FLAGS},
          {"Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"SUNDIALS", SUNDIALS_VERSION},
          {"GSL", GSL_VERSION},
          {"GiNaC", fmt::format("{}.{}.{}", GINACLIB_MAJOR_VERSION, GINACLIB_MINOR_VERSION, GINACLIB_MICRO_VERSION)},
          {"fmt", RICOCHET_FMT_VERSION},
          {"Google Benchmark", RICOCHET_BENCHMARK_VERSION},
          {"processor", processor()},
          {"threads", std::thread::hardware_concurrency()},
          {"governor", governor.empty() ? "not visible" : governor},
          {"date", date()}};
}

}  // namespace ricochet
