#pragma once

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>

#include "methods/external/external_client.h"

namespace ricochet {

/// A field of an answer is missing, or its type, size or range violates README.md; names the field and the requirement.
struct BadAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// @throws BadAnswer
ClientGreeting greeting_of(const nlohmann::json& answer);
/// @throws BadAnswer with the client's reason if it refuses
void require_ok(const nlohmann::json& answer);
/// Checks all sizes and ranges before it uses anything of the answer. @throws BadAnswer
Solution solution_of(const nlohmann::json& answer, const Problem& problem);

}  // namespace ricochet
