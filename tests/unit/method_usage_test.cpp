// The usage line of a method names options that it takes, and together only such as are accepted together. Brackets
// hold options; inside them others stand that go with the values before them; the same option in two brackets is a
// choice between them.
#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/input_text.h"

namespace ricochet {
namespace {

/// "[,cone=polyhedral[,facets=8]]": an option, its values, and what goes with them.
struct UsageOption {
  std::string name;
  std::vector<std::string> values;
  std::vector<std::string> with;  ///< ",facets=8"
};

std::vector<std::string> split_at(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

std::vector<UsageOption> options_of(const std::string& usage) {
  static const std::regex bracket(R"(\[,(\w+)=([^\[\]]+)((\[,[^\[\]]+\])*)\])"), inside(R"(\[(,[^\[\]]+)\])");
  std::vector<UsageOption> options;
  for (std::sregex_iterator found(usage.begin(), usage.end(), bracket), end; found != end; ++found) {
    options.push_back({(*found)[1], split_at((*found)[2], '|'), {}});
    const std::string with = (*found)[3];
    for (std::sregex_iterator other(with.begin(), with.end(), inside); other != end; ++other)
      options.back().with.push_back((*other)[1]);
  }
  return options;
}

/// A value to put in place of one that the usage describes.
std::string value_for(const std::string& value) {
  if (value == "N") return "100";
  if (value == "N/m") return "1e5";
  if (value == "m") return "1e-6";
  if (value == "m/s") return "1e-3";
  return value;
}

/// Whether it is accepted, or would be in a program that has the library.
std::string refusal(const std::string& spec) {
  try {
    make_method(spec);
  } catch (const InputError& error) {
    const std::string message = error.what();
    return message.find("not built") == std::string::npos ? message : "";
  }
  return "";
}

/// methods/sources.bib says for each entry of which methods it is the source.
TEST(MethodSources, AreInTheBibliography) {
  const std::string bibliography = read_input_text(find_project_file("methods/sources.bib"), "bibliography");
  const std::regex field("ricochet = \\{([^}]*)\\}"), word("[a-z0-9_]+"), doi("doi = \\{([^}]*)\\}");
  std::set<std::string> cited, known, dois;
  const auto all = [](const std::string& text, const std::regex& pattern, auto use) {
    for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) use(*match);
  };
  all(bibliography, field,
      [&](const auto& entry) { all(entry[1].str(), word, [&](const auto& name) { cited.insert(name[0]); }); });
  all(bibliography, doi, [&](const auto& entry) {
    EXPECT_TRUE(entry[1].str().starts_with("10.")) << entry[1];
    EXPECT_TRUE(dois.insert(entry[1]).second) << entry[1] << " is there twice";
  });
  // Registered by libraries that may be missing.
  const std::set<std::string> optional = {"bullet", "ode", "mujoco", "box2d", "external"};
  for (const auto& method : methods()) {
    if (method.file.find("/tests/") == std::string::npos) known.insert(method.name);  // not those of other tests
  }
  for (const auto& name : known) {
    if (!optional.contains(name)) EXPECT_TRUE(cited.contains(name)) << name << " has no source in methods/sources.bib";
  }
  for (const auto& name : cited)
    EXPECT_TRUE(known.contains(name) || optional.contains(name)) << name << " is no method";
}

TEST(MethodSources, CanBeFound) {
  std::istringstream lines(read_input_text(find_project_file("methods/sources.bib"), "bibliography"));
  std::string entry;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("%")) continue;
    entry += line + "\n";
    if (line != "}") continue;
    EXPECT_TRUE(std::regex_search(entry, std::regex(R"(\byear = \{(1[89]|20)\d\d\})"))) << entry;
    EXPECT_TRUE(std::regex_search(entry, std::regex(R"(\b(doi = \{10\.|eprint = \{\d|url = \{https?://))"))) << entry;
    entry.clear();
  }
}

/// One version in all three, and the date and the preprint that a citation needs.
TEST(Citation, AgreesWithTheProgram) {
  const auto text = [](const char* file) { return read_input_text(find_project_file(file), "text"); };
  const std::string citation = text("CITATION.cff"), build = text("CMakeLists.txt"), meta = text("codemeta.json");
  std::smatch version;
  ASSERT_TRUE(std::regex_search(build, version, std::regex(R"(project\(ricochet VERSION ([0-9.]+))")));
  EXPECT_NE(citation.find("\nversion: " + version[1].str() + "\n"), std::string::npos);
  EXPECT_NE(meta.find("\"version\": \"" + version[1].str() + "\""), std::string::npos);
  std::smatch date;
  ASSERT_TRUE(std::regex_search(citation, date, std::regex(R"(\ndate-released: (\d{4}-\d\d-\d\d)\n)")));
  EXPECT_NE(meta.find("\"datePublished\": \"" + date[1].str() + "\""), std::string::npos);
  for (const auto& file : {citation, meta}) EXPECT_NE(file.find("10.48550/arXiv.2305.17003"), std::string::npos);
}

TEST(MethodUsage, NamesOptionsThatAreAcceptedTogether) {
  int n_tried = 0;
  for (const auto& method : methods()) {
    if (!method.make || method.examples.empty()) continue;
    const std::string head = method.examples.front().substr(0, method.examples.front().find(','));
    std::map<std::string, std::string> chosen;  // by option, the first of its brackets
    for (const auto& option : options_of(method.usage)) {
      for (const auto& value : option.values) {
        if (value == "...") continue;
        std::string text = "," + option.name + "=" + value_for(value);
        for (const auto& with : option.with) {
          const auto equals = with.find('=');
          text += with.substr(0, equals + 1) + value_for(with.substr(equals + 1));
        }
        EXPECT_EQ(refusal(head + text), "") << method.usage;
        ++n_tried;
        chosen.try_emplace(option.name, text);
      }
    }
    std::string together = head;
    for (const auto& [name, text] : chosen) together += text;
    EXPECT_EQ(refusal(together), "") << method.usage;
  }
  EXPECT_GT(n_tried, 100);
}

}  // namespace
}  // namespace ricochet
