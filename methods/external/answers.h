#pragma once

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>

#include "methods/external/external_client.h"

namespace ricochet {

/// An answer with a field that is missing, or of another type, size or range than README.md says: which, and what is
/// required.
struct BadAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// @throws BadAnswer
ClientGreeting greeting_of(const nlohmann::json& answer);
/// @throws BadAnswer with the client's reason if it refuses
void require_ok(const nlohmann::json& answer);
/// Nothing of an answer is believed before its sizes and ranges are right. @throws BadAnswer
Solution solution_of(const nlohmann::json& answer, const Problem& problem);

}  // namespace ricochet
