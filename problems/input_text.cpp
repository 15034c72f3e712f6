#include "problems/input_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <vector>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr std::size_t kMostBytes = std::size_t{256} << 20;
constexpr int kDeepest = 64;             // our own files have 8 levels
constexpr std::size_t kMostShown = 300;  // of a message that quotes the text

/// Control characters that terminals execute: C0, DEL and, in UTF-8, C1.
bool has_control_character(const std::string& text) {
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto byte = static_cast<unsigned char>(text[k]);
    if (byte < 0x20 || byte == 0x7f) return true;
    if (byte == 0xc2 && k + 1 < text.size() && static_cast<unsigned char>(text[k + 1]) < 0xa0) return true;
  }
  return false;
}

/// Follows the parser through the text to know the current place.
class StrictReading {
 public:
  explicit StrictReading(const std::string& name) : name_(name) {}

  bool operator()(int /*depth*/, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    switch (event) {
      case Event::object_start:
      case Event::array_start:
        enter_value();
        open_.push_back({event == Event::array_start, {}, {}, 0});
        if (open_.size() > kDeepest)
          throw InputError(fmt::format("{}: {}: values are nested more than {} deep", name_, place(), kDeepest));
        break;
      case Event::object_end:
      case Event::array_end:
        open_.pop_back();
        break;
      case Event::key:
        enter_field(parsed.get_ref<const std::string&>());
        break;
      case Event::value:
        enter_value();
        if (parsed.is_string()) refuse_control_characters(parsed);
        break;
    }
    return true;
  }

 private:
  struct Open {
    bool is_list;
    std::string field;
    std::set<std::string> fields;
    std::size_t entries;
  };

  void enter_value() {
    if (!open_.empty() && open_.back().is_list) ++open_.back().entries;
  }
  void enter_field(const std::string& field) {
    open_.back().field = "?";
    refuse_control_characters(field);
    open_.back().field = field;
    if (!open_.back().fields.insert(field).second)
      throw InputError(fmt::format("{}: {}: this field is given twice", name_, place()));
  }
  void refuse_control_characters(const json& text) const {
    if (has_control_character(text.get_ref<const std::string&>()))
      throw InputError(fmt::format("{}: {} = {}: control characters are not allowed", name_, place(),
                                   text.dump(-1, ' ', /*ensure_ascii=*/true).substr(0, kMostShown)));
  }
  /// "contacts[1].e"
  std::string place() const {
    std::string text;
    for (const Open& open : open_) {
      if (open.is_list)
        text += open.entries > 0 ? fmt::format("[{}]", open.entries - 1) : "";
      else
        text += (text.empty() || open.field.empty() ? "" : ".") + open.field;
    }
    if (text.size() > kMostShown) text = text.substr(0, kMostShown) + "...";
    return text.empty() ? "text" : text;
  }

  const std::string& name_;
  std::vector<Open> open_;
};

}  // namespace

std::string read_input_text(const std::string& path, const std::string& what) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(what, path, "it is a directory, a file is required");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(what, path, "cannot be opened");
  std::string text;
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  while (file) {
    const std::size_t size = text.size();
    text.resize(size + kPiece);
    file.read(text.data() + size, kPiece);
    text.resize(size + static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMostBytes)
      throw InputError(what, path, fmt::format("at most {} MB are possible", kMostBytes >> 20));
  }
  if (file.bad()) throw InputError(what, path, "cannot be read");
  return text;
}

json parse_input_json(const std::string& text, const std::string& name) {
  try {
    StrictReading reading(name);
    return json::parse(text, std::ref(reading), true, /*ignore_comments=*/true);
  } catch (const json::exception& error) {
    std::string why = error.what();
    if (why.size() > kMostShown) why = why.substr(0, kMostShown) + "...";
    throw InputError(fmt::format("{}: not valid JSON: {}", name, why));
  }
}

json read_input_json(const std::string& path, const std::string& what) {
  return parse_input_json(read_input_text(path, what), path);
}

}  // namespace ricochet
