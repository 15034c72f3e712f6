#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// The bytes of a file or a pipe named by a user.
/// @param what  kind of the file, for messages: "scene file"
/// @throws InputError for one that does not exist, is a directory, cannot be read, or has more than 256 MB
std::string read_input_text(const std::string& path, const std::string& what);

/// Parses JSON and rejects what RFC 8259 allows but would lose data or spoil messages: fields that are given twice,
/// nesting deeper than 64 levels, and control characters, which could overwrite the message that shows them.
/// Comments // and /* */ are skipped.
/// @param name  of the text for messages, a file for example
/// @throws InputError with the place: "scene.json: contacts[1].e: this field is given twice"
nlohmann::json parse_input_json(const std::string& text, const std::string& name);

/// parse_input_json() of read_input_text(). @throws InputError
nlohmann::json read_input_json(const std::string& path, const std::string& what);

}  // namespace ricochet
