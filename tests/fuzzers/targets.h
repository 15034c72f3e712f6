#pragma once

#include <string>

namespace ricochet::fuzzing {

// What a user may give, as any bytes: each function reads a text as the program does, and uses what it read. Bad input
// is an InputError, which the function catches; anything else that comes out of it is a mistake of ours.

void formula(const std::string& text);
void scene(const std::string& text);
void method_spec(const std::string& text);
void tableau(const std::string& text);
void results(const std::string& text);
void baseline(const std::string& text);
void experiment(const std::string& text);
void ensemble(const std::string& text);

/// A file with this text, for readers of files; the next call writes over it.
std::string file_of(const std::string& text);

}  // namespace ricochet::fuzzing
