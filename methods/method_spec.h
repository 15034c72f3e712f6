#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "problems/named_values.h"

namespace ricochet {

/// The text that selects a method, taken apart: NAME[:ARGUMENT...][,OPTION=VALUE...], for example
/// "fesd:radau-iia:3,elements=as_needed". Every accessor throws InputError for a value that is not allowed.
class MethodSpec {
 public:
  explicit MethodSpec(const std::string& text);

  const std::string& text() const { return text_; }
  const std::string& name() const { return name_; }
  const std::vector<std::string>& arguments() const { return arguments_; }

  double number(const std::string& option, double fallback, double min, double max) const;
  int whole_number(const std::string& option, int fallback, int min, int max) const;
  /// One of `choices`; the first is the default.
  std::string choice(const std::string& option, const std::vector<std::string>& choices) const;
  template <class Value>
  Value choice(const std::string& option, const Names<Value>& names) const {
    return *ricochet::find(names, choice(option, list(names)));
  }

  /// @throws InputError for options that no accessor asked for, or more arguments than `max_arguments`
  void finish(std::size_t max_arguments) const;

 private:
  const std::string* find(const std::string& option) const;

  std::string text_, name_;
  std::vector<std::string> arguments_;
  std::map<std::string, std::string> options_;
  mutable std::set<std::string> known_;
};

}  // namespace ricochet
