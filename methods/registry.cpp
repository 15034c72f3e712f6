#include "methods/registry.h"

#include <fmt/format.h>

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
