#pragma once

#include <ginac/ginac.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

/// @file
/// CanonicalOrder: an order of operands that is the same in every run.

namespace ricochet {

/// GiNaC orders operands by memory address and moves minus signs accordingly. Here they are ordered by the hash of their
/// structure up to the sign. A change of sign is exact, so what is computed in this order rounds the same in every run.
class CanonicalOrder {
 public:
  /// Hash of an expression up to its sign, and the sign.
  struct Shape {
    std::uint64_t hash = 0;
    bool negative = false;
  };

  /// @param name  of a symbol or constant, the same in every run. GiNaC's own name contains a counter of the process
  ///              for a symbol without a name.
  explicit CanonicalOrder(std::function<std::string(const GiNaC::ex&)> name) : name_(std::move(name)) {}

  /// Operands of a sum or product.
  std::vector<GiNaC::ex> sorted(const GiNaC::ex& e);
  /// Shape of an expression.
  Shape shape(const GiNaC::ex& e);

 private:
  std::function<std::string(const GiNaC::ex&)> name_;
  std::map<GiNaC::ex, Shape, GiNaC::ex_is_less> shapes_;
};

/// The text that GiNaC prints.
std::string printed(const GiNaC::ex& e);

}  // namespace ricochet
