#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/named_values.h"

namespace ricochet {

/// An option that a method asks its text for.
struct MethodOption {
  std::string name;
  std::string fallback;              ///< empty: the method chooses
  std::string allowed;               ///< "a number from 0.5 to 1", "one of on, off"
  std::vector<std::string> choices;  ///< the default first; empty for a number
};

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

  /// What the accessors were asked for so far, in this order.
  const std::vector<MethodOption>& asked_for() const { return asked_for_; }

 private:
  double number_of(const MethodOption& option, double fallback, double min, double max) const;
  /// The value that is given, after the question is noted; null for none.
  const std::string* find(const MethodOption& option) const;

  std::string text_, name_;
  std::vector<std::string> arguments_;
  std::map<std::string, std::string> options_;
  mutable std::vector<MethodOption> asked_for_;
};

}  // namespace ricochet
