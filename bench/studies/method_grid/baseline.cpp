#include "bench/studies/method_grid/baseline.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "problems/input_error.h"
#include "reports/order_fit.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kOrderSlack = 0.1;
constexpr double kErrorFactor = 1.1;
constexpr double kErrorFactorOfTolerance = 10;
constexpr double kErrorRounding = 1e-11;

const Record* find(const GridResults& results, const std::string& method, const std::string& setting) {
  for (const Record* run : results.of(method)) {
    if (run->setting() == setting) return run;
  }
  return nullptr;
}

}  // namespace

BaselineCheck check_baseline(const GridResults& results, const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError("baseline file", path, "cannot be opened");
  BaselineCheck check;
  try {
    const json baseline = json::parse(file);
    const std::string experiment = baseline.at("experiment");
    if (experiment != results.id) {
      throw InputError("experiment of the baseline", experiment, fmt::format("the results belong to {}", results.id));
    }
    for (const auto& line : baseline.at("orders")) {
      const std::string method = line.at("method");
      const double then = line.at("slope");
      const auto fit = fit_order(results.of(method));
      ++check.compared;
      if (!fit) {
        check.regressions.push_back(
            fmt::format("{}: order {:.2f} in the baseline, now no asymptotic range", method, then));
      } else if (fit->slope < then - kOrderSlack) {
        check.regressions.push_back(
            fmt::format("{}: order {:.2f} in the baseline, now {:.2f}", method, then, fit->slope));
      }
    }
    for (const auto& line : baseline.at("runs")) {
      const std::string method = line.at("method"), setting = line.at("setting");
      const bool succeeded = line.at("error").is_number();
      const Record* run = find(results, method, setting);
      const std::string name = fmt::format("{} at {}", method, setting);
      ++check.compared;
      if (!run) {
        check.regressions.push_back(fmt::format("{}: this run is missing", name));
      } else if (succeeded && !run->succeeded()) {
        check.regressions.push_back(
            fmt::format("{}: succeeded in the baseline, now {}: {}", name, run->status, run->message));
      } else if (succeeded) {
        const double then = line.at("error");
        if (then >= kAsymptoticError * run->solution_size) continue;
        const double factor = run->steps > 0 ? kErrorFactor : kErrorFactorOfTolerance;
        if (!(run->error <= factor * then + kErrorRounding * run->solution_size)) {
          check.regressions.push_back(
              fmt::format("{}: error {:.3e} in the baseline, now {:.3e}", name, then, run->error));
        } else if (run->error < 0.5 / factor * then - kErrorRounding * run->solution_size) {
          check.improvements.push_back(
              fmt::format("{}: error {:.3e} in the baseline, now {:.3e}", name, then, run->error));
        }
      } else if (run->succeeded()) {
        check.improvements.push_back(fmt::format("{}: failed in the baseline, now succeeds", name));
      }
    }
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not a baseline file: {}", path, error.what()));
  }
  return check;
}

void write_baseline(const GridResults& results, const std::string& path) {
  if (std::filesystem::exists(path))
    throw InputError("baseline file", path, "it exists; remove it first to replace it");
  json orders = json::array(), runs = json::array();
  for (const auto& method : results.methods()) {
    const auto list = results.of(method);
    if (list.front()->steps > 0) {
      if (const auto fit = fit_order(list))
        orders.push_back({{"method", method}, {"slope", std::round(fit->slope * 1e4) / 1e4}});
    }
    for (const Record* run : list) {
      json error;
      if (run->succeeded()) error = std::stod(fmt::format("{:.4e}", run->error));
      runs.push_back({{"method", method}, {"setting", run->setting()}, {"error", error}});
    }
  }
  std::ofstream file(path);
  // One entry a line, so that a change of the baseline reads well in a diff.
  file << fmt::format("{{\"experiment\": {},\n \"orders\": [\n", json(results.id).dump());
  for (std::size_t k = 0; k < orders.size(); ++k)
    file << "  " << orders[k].dump() << (k + 1 < orders.size() ? ",\n" : "\n");
  file << " ],\n \"runs\": [\n";
  for (std::size_t k = 0; k < runs.size(); ++k) file << "  " << runs[k].dump() << (k + 1 < runs.size() ? ",\n" : "\n");
  file << " ]}\n";
  if (!file.flush()) throw InputError("baseline file", path, "cannot be written");
}

}  // namespace ricochet
