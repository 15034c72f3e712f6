#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/named_values.h"

/// @file
/// The text that selects a method, and the options in it.

namespace ricochet {

/// An option that a method reads from its text.
struct MethodOption {
  std::string name;                  ///< "theta"
  std::string fallback;              ///< its value when it is not given; empty: the method chooses
  std::string allowed;               ///< "a number from 0.5 to 1", "one of on, off"
  std::vector<std::string> choices;  ///< the default first; empty for a number
};

/// The text that selects a method, parsed: NAME[:ARGUMENT...][,OPTION=VALUE...], for example
/// "fesd:radau-iia:3,elements=as_needed". A method reads its options from it.
class MethodSpec {
 public:
  /// Parses `text`. @throws InputError for an option without value, or one that is given twice
  explicit MethodSpec(const std::string& text);

  const std::string& text() const { return text_; }                         ///< The whole text, as it was given.
  const std::string& name() const { return name_; }                         ///< Name, before the first colon.
  const std::vector<std::string>& arguments() const { return arguments_; }  ///< Between colons, after the name.

  /// The number given for `option`, or `fallback` if none is given. @throws InputError unless it is a number from `min`
  /// to `max`
  double number(const std::string& option, double fallback, double min, double max) const;
  /// The number given for `option`, or 0 if none is given. @param allowed  its range, which may depend on the problem
  /// @throws InputError unless it is a finite number above 0
  double positive_number(const std::string& option, const std::string& allowed) const;
  /// The whole number given for `option`, or `fallback` if none is given.
  /// @throws InputError unless it is from `min` to `max`
  int whole_number(const std::string& option, int fallback, int min, int max) const;
  /// The value given for `option`, one of `choices`; the first is the default.
  /// @throws InputError for anything else, with the choices
  std::string choice(const std::string& option, const std::vector<std::string>& choices) const;
  /// The value whose name is given for `option`; the first of `names` is the default.
  /// @throws InputError for anything else, with the names
  template <class Value>
  Value choice(const std::string& option, const Names<Value>& names) const {
    return *ricochet::find(names, choice(option, list(names)));
  }

  /// @throws InputError for options that no accessor has read, or more arguments than `max_arguments`
  void finish(std::size_t max_arguments) const;

  /// Options that the accessors have read so far, in this order.
  const std::vector<MethodOption>& asked_for() const { return asked_for_; }

 private:
  double number_of(const MethodOption& option, double fallback, double min, double max) const;
  /// Records `option` as read. @return the value that is given; null for none
  const std::string* find(const MethodOption& option) const;

  std::string text_, name_;
  std::vector<std::string> arguments_;
  std::map<std::string, std::string> options_;
  mutable std::vector<MethodOption> asked_for_;
};

}  // namespace ricochet
