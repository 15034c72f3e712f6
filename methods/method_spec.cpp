#include "methods/method_spec.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>

#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string::npos) return parts;
    begin = end + 1;
  }
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

const std::string* MethodSpec::find(const std::string& option) const {
  known_.insert(option);
  const auto found = options_.find(option);
  return found == options_.end() ? nullptr : &found->second;
}

double MethodSpec::number(const std::string& option, double fallback, double min, double max) const {
  const std::string* text = find(option);
  if (!text) return fallback;
  double value = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (error != std::errc() || end != text->data() + text->size() || !(value >= min && value <= max)) {
    throw InputError(fmt::format("{}: {}", name_, option), *text,
                     fmt::format("a number from {} to {} is required", min, max));
  }
  return value;
}

int MethodSpec::whole_number(const std::string& option, int fallback, int min, int max) const {
  const double value = number(option, fallback, min, max);
  if (value != std::floor(value))
    throw InputError(fmt::format("{}: {}", name_, option), value, "a whole number is required");
  return static_cast<int>(value);
}

std::string MethodSpec::choice(const std::string& option, const std::vector<std::string>& choices) const {
  const std::string* text = find(option);
  if (!text) return choices.front();
  for (const auto& candidate : choices) {
    if (candidate == *text) return candidate;
  }
  throw InputError(fmt::format("{}: {}", name_, option), *text,
                   fmt::format("one of {} is required", fmt::join(choices, ", ")));
}

void MethodSpec::finish(std::size_t max_arguments) const {
  if (arguments_.size() > max_arguments) {
    throw InputError(fmt::format("{}: argument", name_), arguments_[max_arguments],
                     fmt::format("at most {} arguments are possible", max_arguments));
  }
  for (const auto& [option, value] : options_) {
    if (!known_.contains(option)) throw_unknown_name("option of " + name_, option, {known_.begin(), known_.end()});
  }
}

}  // namespace ricochet
