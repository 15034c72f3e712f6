#include "bench/ensemble/distribution.h"

#include <fmt/format.h>
#include <gsl/gsl_cdf.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "bench/experiment/experiment_file.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr const char* kDistributions =
    "NAME=uniform:FROM:TO, log-uniform:FROM:TO, normal:MEAN:DEVIATION, grid:FROM:TO:POINTS, "
    "log-grid:FROM:TO:PER_DECADE or values:A:B:... is required";
constexpr int kMostPoints = 1000000;

/// The numbers after the word, "uniform:0:1". @throws InputError for anything else
std::vector<double> numbers_of(const std::string& text, const std::string& arguments) {
  std::vector<double> numbers;
  std::istringstream stream(arguments);
  for (std::string part; std::getline(stream, part, ':');) {
    double value = 0;
    const auto [rest, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || rest != part.data() + part.size() || !std::isfinite(value))
      throw InputError("vary", text, fmt::format("'{}' is not a finite number", part));
    numbers.push_back(value);
  }
  return numbers;
}

std::vector<double> linear_grid(const std::string& text, double from, double to, double points) {
  if (!(points >= 2 && points <= kMostPoints && points == std::floor(points)))
    throw InputError("vary", text, fmt::format("a whole number of points from 2 to {} is required", kMostPoints));
  std::vector<double> grid;
  for (double k = 0; k < points; ++k) grid.push_back(from + (to - from) * (k / (points - 1)));
  return grid;
}

}  // namespace

VariedQuantity::VariedQuantity(const std::string& text) : text_(text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw InputError("vary", text, kDistributions);
  name_ = text.substr(0, equals);
  const auto colon = std::min(text.find(':', equals), text.size());
  const std::string word = text.substr(equals + 1, colon - equals - 1);
  at_ = numbers_of(text, colon < text.size() ? text.substr(colon + 1) : "");
  const auto require = [&](bool ok, const char* allowed) {
    if (!ok) throw InputError("vary", text, allowed);
  };
  if (word == "uniform") {
    kind_ = Kind::uniform;
    require(at_.size() == 2 && at_[0] < at_[1], "uniform:FROM:TO with FROM < TO is required");
  } else if (word == "log-uniform") {
    kind_ = Kind::log_uniform;
    require(at_.size() == 2 && 0 < at_[0] && at_[0] < at_[1], "log-uniform:FROM:TO with 0 < FROM < TO is required");
  } else if (word == "normal") {
    kind_ = Kind::normal;
    require(at_.size() == 2 && at_[1] > 0, "normal:MEAN:DEVIATION with DEVIATION > 0 is required");
  } else if (word == "grid") {
    require(at_.size() == 3, "grid:FROM:TO:POINTS is required");
    at_ = linear_grid(text, at_[0], at_[1], at_[2]);
  } else if (word == "log-grid") {
    require(at_.size() == 3, "log-grid:FROM:TO:PER_DECADE is required");
    at_ = logarithmic_grid(at_[0], at_[1], at_[2], "vary = " + text);
  } else {
    require(word == "values" && !at_.empty(), kDistributions);
  }
}

double VariedQuantity::drawn(double u) const {
  switch (kind_) {
    case Kind::uniform:
      return at_[0] + (at_[1] - at_[0]) * u;
    case Kind::log_uniform:
      return at_[0] * std::pow(at_[1] / at_[0], u);
    case Kind::normal:
      return at_[0] + at_[1] * gsl_cdf_ugaussian_Pinv(u);
    case Kind::grid:
      break;
  }
  return std::nan("");
}

}  // namespace ricochet
