#include "methods/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

std::map<std::string, MethodEntry>& entries() {
  static std::map<std::string, MethodEntry> entries;
  return entries;
}

/// ":gauss:2" of "fesd:gauss:2,n_fe=3"
std::string argument_text(const std::string& text) {
  const MethodSpec spec(text);
  std::string joined;
  for (const auto& argument : spec.arguments()) joined += ":" + argument;
  return joined;
}

}  // namespace

bool add_method(MethodEntry entry) {
  const std::string name = entry.name;
  if (!entries().emplace(name, std::move(entry)).second)
    throw std::logic_error("two methods are registered as " + name);
  return true;
}

std::vector<MethodEntry> methods() {
  std::vector<MethodEntry> list;
  for (const auto& [name, entry] : entries()) list.push_back(entry);
  return list;
}

std::vector<MethodOption> options_of(const MethodEntry& method) {
  std::vector<MethodOption> options;
  const auto ask = [&](const std::string& text) {
    const MethodSpec spec(text);
    try {
      method.make(spec);
    } catch (const InputError&) {  // not every choice goes with every other; what was asked before is known
    }
    for (const auto& option : spec.asked_for()) {
      if (std::ranges::find(options, option.name, &MethodOption::name) == options.end()) options.push_back(option);
    }
  };
  for (const auto& example : method.examples) ask(example);
  for (std::size_t k = 0; k < options.size(); ++k) {
    const MethodOption option = options[k];  // the list grows
    for (const auto& choice : option.choices)
      ask(fmt::format("{},{}={}", method.name + argument_text(method.examples.front()), option.name, choice));
  }
  return options;
}

std::unique_ptr<Method> make_method(const std::string& text) {
  const MethodSpec spec(text);
  const auto entry = entries().find(spec.name());
  if (entry == entries().end()) throw_unknown_name("method", spec.name(), keys_of(entries()));
  if (!entry->second.make)
    throw InputError(fmt::format("method {} is not built: {}", spec.name(), entry->second.not_built));
  try {
    auto method = entry->second.make(spec);
    spec.finish(entry->second.max_arguments);
    return method;
  } catch (const InputError& error) {
    throw InputError(fmt::format("method '{}': {}\n  usage: {}", text, error.what(), entry->second.usage));
  }
}

}  // namespace ricochet
