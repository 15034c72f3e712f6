#pragma once

#include <nlohmann/json.hpp>

namespace ricochet {

/// Conditions of a measurement: git revision, compiler and flags, library versions, processor, frequency
/// scaling, date.
nlohmann::json environment();

/// Hash of this program's own file and of its plugins: results of another build are not the same results.
std::string program_hash();

/// "ricochet 0.1.0, revision ab12cd3"
std::string version_text();

/// 16 hexadecimal digits that change with the text.
std::string hash_of(const std::string& text);

}  // namespace ricochet
