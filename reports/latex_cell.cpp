#include "reports/latex_cell.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <numeric>
#include <regex>
#include <vector>

namespace ricochet {
namespace {

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}
bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}
/// Of a letter of Computer Modern with 10 points, in points.
double width_of(char c) {
  static const std::map<std::string, double> groups = {{"ijl.,:;!'[]", 2.9},
                                                       {"f", 3.1},
                                                       {"rst()", 3.95},
                                                       {"cezagovy1234567890*$^\"/_~", 5.1},
                                                       {"bdhknpqux#", 5.6},
                                                       {"mMW@%&Q+=<>", 8.4},
                                                       {"wCTVXYDAENOGHKRUB", 7.7},
                                                       {"FILPSZJ", 6.8}};
  static const auto widths = [] {
    std::array<double, 256> list{};
    list.fill(5.6);  // in UTF-8, of the first byte
    for (const auto& [letters, width] : groups) {
      for (const char letter : letters) list[static_cast<unsigned char>(letter)] = width;
    }
    list[' '] = list['-'] = 3.4;
    return list;
  }();
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U ? 0 : widths[static_cast<unsigned char>(c)];
}

/// Behind which letter of a word LaTeX may break it: names of methods have colons, commas and settings.
bool may_break(const std::string& text, std::size_t k) {
  if (k + 1 >= text.size() || text[k + 1] == ' ') return false;
  if (text[k] == '-')  // not "FESD-J"
    return k > 1 && k + 2 < text.size() && is_letter(text[k - 2]) && is_letter(text[k - 1]) && is_letter(text[k + 1]) &&
           is_letter(text[k + 2]);
  if (text[k] != ':' && text[k] != ',') return false;
  constexpr std::size_t kShort = 3;  // letters, which do not get a line of their own
  const std::size_t next = std::min(text.find_first_of(":, ", k + 1), text.size());
  return next - k > kShort;
}

/// Whether a byte of UTF-8 belongs to the letter before it; 0xCC begins what is combined with it.
bool continues(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte & 0xC0U) == 0x80U || byte == 0xCCU;
}

std::vector<std::string> letters_of(const std::string& text) {
  std::vector<std::string> letters;
  for (const char c : text) {
    if (continues(c) && !letters.empty())
      letters.back() += c;
    else
      letters.emplace_back(1, c);
  }
  return letters;
}

constexpr char kBreak = '\x04';  // in a cell, where its column may wrap it

/// Typesets a text: ranges and intervals, minus signs, "us" and "<=" are what they mean.
class Typesetter {
 public:
  /// @param is_interval  "1.0 .. 1.2" is one, not a range
  Typesetter(const std::string& raw, bool is_interval) : text_(raw) {
    static const std::regex range(R"((\S+) \.\. (\S+))"), inner(R"((\d)\.\.(\d))"), micro(R"(\bus\b)");
    std::smatch ends;
    if (std::regex_match(text_, ends, range)) {
      is_math_ = is_interval;
      text_ = is_interval ? "[" + ends[1].str() + ", " + ends[2].str() + "]" : ends[1].str() + "\x02" + ends[2].str();
    }
    text_ = std::regex_replace(std::regex_replace(text_, inner, "$1\x02$2"), micro, "\x01s");
  }

  LatexCell cell() {
    if (is_math_) return {"$" + text_ + "$", measure(text_) + 1, measure(text_) + 1};
    for (std::size_t k = 0; k < text_.size(); ++k) add(k);
    end_word();
    return cell_;
  }

 private:
  static double measure(const std::string& text) {
    return std::accumulate(text.begin(), text.end(), 0.0, [](double sum, char c) { return sum + width_of(c); });
  }
  void end_word() {
    cell_.word = std::max(cell_.word, word_);
    word_ = 0;
  }
  void put(const std::string& tex, double width) {
    cell_.tex += tex;
    cell_.width += width;
    word_ += width;
  }
  void add(std::size_t k) {
    const char c = text_[k];
    const bool begins = k == 0 || text_[k - 1] == ' ' || text_[k - 1] == '(';
    const bool before_digit = k + 1 < text_.size() && is_digit(text_[k + 1]);
    if (c == ' ') {
      end_word();
      cell_.tex += ' ';
      cell_.width += width_of(' ');
    } else if (c == '\x01') {
      put("$\\mu$", 6);
    } else if (c == '\x02') {
      put("\\mbox{--}", 5.1);
    } else if (c == '-' && begins && before_digit) {
      put("$-$", 7.8);
    } else if (c == '-' && k + 1 < text_.size() && text_[k + 1] == '-') {
      put("-{}", width_of(c));  // of an option: two of them would be a dash
    } else if (c == '-' && before_digit) {
      put("\\mbox{-}", width_of(c));  // of 1e-3: LaTeX breaks a word behind a hyphen
    } else if ((c == '<' || c == '>') && k + 1 < text_.size() && text_[k + 1] == '=') {
      put(c == '<' ? "$\\leq$" : "$\\geq$", 7.8);
      text_[k + 1] = '\x03';
    } else if (c != '\x03' && !continues(c)) {
      put(escape_latex(letters_of(text_.substr(k, 6)).front()), width_of(c));
    }
    if (may_break(text_, k)) {
      if (c != '-') cell_.tex += kBreak;
      end_word();
    }
  }

  std::string text_;
  bool is_math_ = false;
  LatexCell cell_;
  double word_ = 0;
};

}  // namespace

std::string escape_latex(const std::string& text) {
  static const std::map<std::string, std::string> escapes = {{"\\", "\\textbackslash{}"},
                                                             {"^", "\\textasciicircum{}"},
                                                             {"~", "\\textasciitilde{}"},
                                                             {"<", "\\textless{}"},
                                                             {">", "\\textgreater{}"},
                                                             {"|", "\\textbar{}"},
                                                             {"&", "\\&"},
                                                             {"%", "\\%"},
                                                             {"$", "\\$"},
                                                             {"#", "\\#"},
                                                             {"_", "\\_"},
                                                             {"{", "\\{"},
                                                             {"}", "\\}"},
                                                             {"θ", "$\\theta$"},
                                                             {"κ", "$\\kappa$"},
                                                             {"λ", "$\\lambda$"},
                                                             {"μ", "$\\mu$"},
                                                             {"µ", "$\\mu$"},
                                                             {"ρ", "$\\rho$"},
                                                             {"σ", "$\\sigma$"},
                                                             {"τ", "$\\tau$"},
                                                             {"ω", "$\\omega$"},
                                                             {"α", "$\\alpha$"},
                                                             {"ε", "$\\varepsilon$"},
                                                             {"±", "$\\pm$"},
                                                             {"×", "$\\times$"},
                                                             {"·", "$\\cdot$"},
                                                             {"≤", "$\\leq$"},
                                                             {"≥", "$\\geq$"},
                                                             {"∞", "$\\infty$"},
                                                             {"²", "$^2$"},
                                                             {"³", "$^3$"},
                                                             {"→", "$\\to$"},
                                                             {"√", "$\\surd$"},
                                                             {"−", "$-$"},
                                                             {"°", "$^\\circ$"},
                                                             {"h̄", "$\\bar h$"}};
  std::string escaped;
  for (const std::string& letter : letters_of(text)) {
    const auto escape = escapes.find(letter);
    escaped += escape == escapes.end() ? letter : escape->second;
  }
  return escaped;
}

LatexCell latex_cell(const std::string& text, bool is_interval) {
  return Typesetter(text, is_interval).cell();
}

std::string with_breaks(const std::string& tex, bool may_wrap) {
  std::string text;
  for (const char c : tex) text += c != kBreak ? std::string(1, c) : may_wrap ? "\\allowbreak{}" : "";
  return text;
}

}  // namespace ricochet
