#include "methods/method_spec.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "problems/input_error.h"
#include "problems/names.h"
#include "problems/split.h"

namespace ricochet {
namespace {

/// A default that nobody may give stands for none.
std::string default_text(double fallback, double min, double max) {
  return fallback >= min && fallback <= max ? fmt::format("{:g}", fallback) : "";
}

}  // namespace

MethodSpec::MethodSpec(const std::string& text) : text_(text) {
  const auto parts = split(text, ',');
  arguments_ = split(parts.front(), ':');
  name_ = arguments_.front();
  arguments_.erase(arguments_.begin());
  for (std::size_t k = 1; k < parts.size(); ++k) {
    const auto equals = parts[k].find('=');
    if (equals == std::string::npos) throw InputError("method option", "'" + parts[k] + "'", "NAME=VALUE is required");
    const std::string option = parts[k].substr(0, equals);
    if (!options_.emplace(option, parts[k].substr(equals + 1)).second)
      throw InputError("method option", "'" + parts[k] + "'", fmt::format("{} is given twice", option));
  }
}

const std::string* MethodSpec::find(const MethodOption& option) const {
  if (std::ranges::find(asked_for_, option.name, &MethodOption::name) == asked_for_.end()) asked_for_.push_back(option);
  const auto found = options_.find(option.name);
  return found == options_.end() ? nullptr : &found->second;
}

double MethodSpec::number_of(const MethodOption& option, double fallback, double min, double max) const {
  const std::string* text = find(option);
  if (!text) return fallback;
  double value = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (error != std::errc() || end != text->data() + text->size() || !(value >= min && value <= max))
    throw InputError(fmt::format("{}: {}", name_, option.name), *text, option.allowed + " is required");
  return value;
}

double MethodSpec::number(const std::string& option, double fallback, double min, double max) const {
  return number_of({option, default_text(fallback, min, max), fmt::format("a number from {} to {}", min, max), {}},
                   fallback, min, max);
}

double MethodSpec::positive_number(const std::string& option, const std::string& allowed) const {
  return number_of({option, "", allowed, {}}, 0, std::numeric_limits<double>::denorm_min(),
                   std::numeric_limits<double>::max());
}

int MethodSpec::whole_number(const std::string& option, int fallback, int min, int max) const {
  const MethodOption question{
      option, default_text(fallback, min, max), fmt::format("a whole number from {} to {}", min, max), {}};
  const double value = number_of(question, fallback, min, max);
  if (value != std::floor(value))
    throw InputError(fmt::format("{}: {}", name_, option), value, question.allowed + " is required");
  return static_cast<int>(value);
}

std::string MethodSpec::choice(const std::string& option, const std::vector<std::string>& choices) const {
  const MethodOption question{option, choices.front(), fmt::format("one of {}", fmt::join(choices, ", ")), choices};
  const std::string* text = find(question);
  if (!text) return choices.front();
  for (const auto& candidate : choices) {
    if (candidate == *text) return candidate;
  }
  throw InputError(fmt::format("{}: {}", name_, option), *text, question.allowed + " is required");
}

void MethodSpec::finish(std::size_t max_arguments) const {
  if (arguments_.size() > max_arguments) {
    throw InputError(fmt::format("{}: argument", name_), arguments_[max_arguments],
                     fmt::format("at most {} arguments are possible", max_arguments));
  }
  std::vector<std::string> known;
  for (const auto& option : asked_for_) known.push_back(option.name);
  std::ranges::sort(known);
  for (const auto& [option, value] : options_) {
    if (!std::ranges::binary_search(known, option)) throw_unknown_name("option of " + name_, option, known);
  }
}

}  // namespace ricochet
