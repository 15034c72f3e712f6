// 300 command lines with one mistake each, made from good ones by a generator with a seed: every one ends in exit code 2,
// its message names the place of the mistake, and nothing is written.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

constexpr int kLines = 300;
constexpr unsigned kSeed = 1;

/// What the value of an option may be, and with it what may be wrong of it.
enum class Kind { flag, whole, number, problem, method, experiment, choice, change, vary, variable, view, in, out };

struct Part {
  std::string option;  ///< "--steps"; empty for an argument without one
  Kind kind;
  std::string value;
  std::vector<std::string> out_of_range{};
  bool may_repeat = false;
};

struct Line {
  std::vector<std::string> command;
  std::vector<Part> parts;
  std::string setting_of_other_kind{};  ///< the option that its method does not take, with a value

  std::vector<std::string> words() const {
    std::vector<std::string> list = command;
    for (const auto& part : parts) {
      if (!part.option.empty()) list.push_back(part.option);
      if (part.kind != Kind::flag) list.push_back(part.value);
    }
    return list;
  }
};

/// For a shell.
std::string quoted(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) {
    text += " '";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    text += "'";
  }
  return text;
}

/// Options have dashes where the fields that they set have underscores.
std::string dashed(std::string text) {
  std::ranges::replace(text, '_', '-');
  return text;
}

// Parts that several lines have.

Part argument(Kind kind, const std::string& value, bool may_repeat = false) {
  return {"", kind, value, {}, may_repeat};
}
Part out(const std::string& option, const std::string& value) {
  return {option, Kind::out, value};
}
Part in(const std::string& option, const std::string& value) {
  return {option, Kind::in, value};
}
Part method(const std::string& value) {
  return {"--method", Kind::method, value};
}
Part set(const std::string& value) {
  return {"--set", Kind::change, value, {}, true};
}
Part whole(const std::string& option, const std::string& value, std::vector<std::string> out_of_range) {
  return {option, Kind::whole, value, std::move(out_of_range)};
}
Part number(const std::string& option, const std::string& value, std::vector<std::string> out_of_range) {
  return {option, Kind::number, value, std::move(out_of_range)};
}
Part steps(const std::string& value) {
  return whole("--steps", value, {"0", "-1", "-50"});
}
Part tolerance(const std::string& value) {
  return number("--tolerance", value, {"-1e-6", "2", "nan", "inf"});
}
Part time_limit() {
  return number("--time-limit", "20", {"-1", "nan"});
}

/// Good command lines, over all commands. They read what is in `folder` and write to out/.
std::vector<Line> good_lines(const fs::path& folder) {
  const std::string scene = test_data("double_pendulum_wall.json"), experiment = (folder / "small.json").string(),
                    results = (folder / "results" / "small.jsonl").string(),
                    baseline = (folder / "baseline.jsonl").string(), study = (folder / "study.json").string();
  const Part spring{"--problem", Kind::problem, "two_balls_spring"};
  const Part sensitivity{"--sensitivity", Kind::variable, "param:e", {}, true};
  const Part depth = number("--allow-penetration", "0.001", {"-1", "nan"});
  const auto vary = [](const std::string& value) { return Part{"--vary", Kind::vary, value, {}, true}; };
  const auto flag = [](const std::string& option) { return Part{option, Kind::flag, ""}; };
  const auto runs = [](const std::string& value) { return whole("--runs", value, {"0", "-3"}); };
  const Part threads = whole("--threads", "1", {"-1", "-8"});
  const Part intervals = whole("--intervals", "4", {"0", "-2"});
  const Part sigma = number("--sigma-0", "0.01", {"0", "-1", "nan"});
  const Part control = argument(Kind::problem, "two_carts");
  const std::string tolerance_too = "--tolerance 1e-6", steps_too = "--steps 100";
  return {
      {{"run"},
       {{"--problem", Kind::problem, "bouncing_ball"},
        method("fesd:gauss:2"),
        steps("20"),
        set("e=0.5"),
        out("--csv", "out/m.csv"),
        out("--animate", "out/m.svg"),
        whole("--points", "5", {"0", "-1"}),
        time_limit(),
        sensitivity},
       tolerance_too},
      {{"run"}, {in("--scene", scene), method("moreau_jean,theta=0.5"), steps("50"), depth}, tolerance_too},
      {{"run"}, {spring, method("cvode:adams"), tolerance("1e-6"), set("k=2000"), set("e=0.4")}, steps_too},
      {{"audit"},
       {argument(Kind::problem, "bouncing_ball"), argument(Kind::method, "fesd:radau-iia:2"), steps("20")},
       tolerance_too},
      {{"audit"}, {spring, method("event_driven"), tolerance("1e-8"), time_limit()}, steps_too},
      {{"ensemble"},
       {spring, vary("k=uniform:1e3:1e4"), vary("v0:0=values:0:0.1"), set("e=0.8"), runs("2"),
        whole("--seed", "2", {"-1"}), method("fesd:gauss:2,elements=as_needed"), steps("50"), threads, time_limit(),
        out("--out", "out/e.csv")},
       tolerance_too},
      {{"ensemble"}, {argument(Kind::in, study), out("--out", "out/study.csv"), runs("1")}, tolerance_too},
      {{"export"}, {{"--problem", Kind::problem, "rocking_block"}, set("mu=0.5"), out("--out", "out/block.json")}},
      {{"list"}, {argument(Kind::problem, "pendulum_wall")}},
      {{"schema"}, {argument(Kind::choice, "scene"), flag("--page")}},
      {{"control"}, {control, flag("--simulate"), sigma, intervals, set("e=0.5"), flag("--no-replay"), time_limit()}},
      {{"control"},
       {control,
        {"--discretisation", Kind::choice, "time_stepping"},
        steps("3"),
        intervals,
        sigma,
        whole("--max-iterations", "400", {"0", "-5"}),
        flag("--no-replay"),
        {"--cone", Kind::choice, "exact"}}},
      {{"mpc"},
       {control, flag("--simulate"), sigma, intervals, whole("--updates", "1", {"0", "4", "-1"}),
        number("--disturbance", "0.001", {"-1", "nan", "inf"})}},
      {{"run-experiment"},
       {argument(Kind::experiment, experiment), flag("--quick"), flag("--no-times"), out("--out", "out/results"),
        number("--time-limit", "20", {"-1", "0"})}},
      {{"show"}, {argument(Kind::in, results, true), {"--view", Kind::view, "orders", {}, true}}},
      {{"report"}, {argument(Kind::in, results, true), out("--out", "out/page")}},
      {{"results"}, {argument(Kind::in, results, true), out("--out", "out/R.md"), out("--tables", "out/tables")}},
      {{"table", "--latex"},
       {argument(Kind::in, results, true), {"--view", Kind::view, "orders", {}, true}, out("--out", "out/table.tex")}},
      {{"table", "--tidy"}, {argument(Kind::in, results), out("--out", "out/tidy.csv")}},
      {{"check"},
       {argument(Kind::in, results, true), in("--baseline", baseline), out("--junit", "out/gate.xml"),
        out("--summary", "out/gate.md")}},
      {{"check"}, {argument(Kind::in, results, true), out("--write", "out/baseline.jsonl")}},
      {{"verify"},
       {method("fesd:radau-iia:3,elements=as_needed"),
        flag("--quick"),
        number("--time-limit", "5", {"-1", "0", "nan"}),
        {"--check", Kind::problem, "order/impacts", {}, true},
        out("--junit", "out/card.xml"),
        out("--badge", "out/card.svg"),
        out("--summary", "out/card.md")}},
      {{"fuzz"},
       {whole("--scenes", "1", {"0", "-1"}),
        whole("--seed", "3", {}),
        {"--family", Kind::problem, "drops", {}, true},
        number("--time-limit", "5", {"0", "-1"}),
        number("--minimise-time", "0", {"-1"}),
        out("--out", "out/fuzz")}},
      {{"fuzz"}, {in("--scene", scene), number("--time-limit", "5", {"-1"})}},
  };
}

/// A line with a mistake, and what its message must say.
struct BadLine {
  std::vector<std::string> words;
  std::string place;
};

class Spoiler {
 public:
  Spoiler(unsigned seed, const fs::path& folder)
      : random_(seed), lines_(good_lines(folder)), file_((folder / "file").string()) {}

  BadLine spoil(std::size_t kind) {
    while (true) {
      line_ = lines_[below(lines_.size())];
      more_.clear();
      const std::string place = (this->*kinds()[kind])();
      if (place.empty()) continue;
      BadLine bad{line_.words(), place};
      bad.words.insert(bad.words.end(), more_.begin(), more_.end());
      return bad;
    }
  }

  using Mistake = std::string (Spoiler::*)();
  static const std::vector<Mistake>& kinds() {
    static const std::vector<Mistake> list = {&Spoiler::option_unknown,
                                              &Spoiler::option_misspelt,
                                              &Spoiler::option_twice,
                                              &Spoiler::option_short,
                                              &Spoiler::value_missing,
                                              &Spoiler::value_of_a_flag,
                                              &Spoiler::command_misspelt,
                                              &Spoiler::required_missing,
                                              &Spoiler::word_too_many,
                                              &Spoiler::not_a_number,
                                              &Spoiler::not_whole,
                                              &Spoiler::out_of_range,
                                              &Spoiler::too_large,
                                              &Spoiler::empty_value,
                                              &Spoiler::problem_unknown,
                                              &Spoiler::experiment_unknown,
                                              &Spoiler::method_unknown,
                                              &Spoiler::method_option_unknown,
                                              &Spoiler::method_value,
                                              &Spoiler::method_argument,
                                              &Spoiler::choice_unknown,
                                              &Spoiler::view_unknown,
                                              &Spoiler::parameter_unknown,
                                              &Spoiler::parameter_value,
                                              &Spoiler::parameter_twice,
                                              &Spoiler::vary_unknown,
                                              &Spoiler::vary_wrong,
                                              &Spoiler::variable_unknown,
                                              &Spoiler::setting_of_other_kind,
                                              &Spoiler::two_that_exclude,
                                              &Spoiler::file_missing,
                                              &Spoiler::file_is_a_folder,
                                              &Spoiler::file_of_nothing,
                                              &Spoiler::file_of_noise,
                                              &Spoiler::out_below_a_file,
                                              &Spoiler::out_is_a_folder};
    return list;
  }

 private:
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  std::string pick(const std::vector<std::string>& list) { return list[below(list.size())]; }
  template <class Is>
  Part* part_that(Is is) {
    std::vector<Part*> found;
    for (auto& part : line_.parts) {
      if (is(part)) found.push_back(&part);
    }
    return found.empty() ? nullptr : found[below(found.size())];
  }
  Part* part_of(std::set<Kind> kinds) {
    return part_that([&](const Part& part) { return kinds.contains(part.kind); });
  }
  static bool has_option(const Part& part) { return !part.option.empty(); }
  static bool takes_value(const Part& part) { return has_option(part) && part.kind != Kind::flag; }
  /// What a message calls it, where the value is handed on without the dashes.
  static std::string name_of(const Part& part) { return part.option.substr(2); }
  /// One letter is left out, said twice or another one.
  std::string misspelt(std::string word, std::size_t from) {
    const std::size_t at = from + below(word.size() - from);
    switch (below(3)) {
      case 0:
        word.erase(at, 1);
        break;
      case 1:
        word.insert(at, 1, word[at]);
        break;
      default:
        word[at] = word[at] == 'x' ? 'y' : 'x';
    }
    return word;
  }
  void insert(Part part) {
    line_.parts.insert(line_.parts.begin() + static_cast<std::ptrdiff_t>(below(line_.parts.size() + 1)),
                       std::move(part));
  }

  std::string option_unknown() {
    const std::string option = pick({"--qqqqqqqq", "--wwwwwwwww=3", "--zz-zz-zz-zz", "--\xc3\xa4\xc3\xb6\xc3\xbc"});
    insert({option, Kind::flag, ""});
    return "'" + option.substr(0, option.find('=')) + "': unknown";
  }
  std::string option_misspelt() {
    Part* part = part_that([](const Part& p) { return p.option.size() > 5 && p.option.starts_with("--"); });
    if (!part) return "";
    const std::string right = part->option, wrong = misspelt(right, 3);
    // --step of `contacts export`, --set of many
    if (wrong == "--step" || wrong == "--set" || wrong == right) return "";
    part->option = wrong;
    return "'" + wrong + "': unknown; did you mean|" + right;
  }
  std::string option_twice() {
    Part* part = part_that([](const Part& p) { return takes_value(p) && !p.may_repeat; });
    if (!part) return "";
    const std::string option = part->option;
    insert(Part(*part));
    return option;
  }
  std::string option_short() {
    const std::string option = pick({"-z", "-Q", "-y", "-?"});
    insert({option, Kind::flag, ""});
    return "'" + option;
  }
  std::string value_missing() {
    Part* part = part_that(takes_value);
    if (!part) return "";
    part->kind = Kind::flag;
    const std::string option = part->option;
    std::swap(*part, line_.parts.back());
    return option;
  }
  std::string value_of_a_flag() {
    Part* part = part_of({Kind::flag});
    if (!part) return "";
    part->option += "=perhaps";
    return part->option.substr(0, part->option.find('='));
  }
  std::string command_misspelt() {
    const std::string right = line_.command.back();
    std::string& word = line_.command.back();
    word = misspelt(word, 0);
    if (word == right || word.starts_with('-')) return "";
    return "'" + word + "': unknown";
  }
  std::string required_missing() {
    // Of lines of which every part of these kinds is needed.
    Part* part = part_of({Kind::method, Kind::choice});
    if (!part || line_.command[0] == "control") return "";
    const std::string name = line_.command[0] == "schema" ? "what" : "method";
    line_.parts.erase(line_.parts.begin() + (part - line_.parts.data()));
    return name;
  }
  std::string word_too_many() {
    if (line_.command[0] == "check") return "";  // which says that --baseline is for one results file
    more_ = {"superfluous"};
    return "superfluous";
  }
  std::string not_a_number() {
    Part* part = part_of({Kind::whole, Kind::number});
    if (!part) return "";
    part->value = pick({"ten", "1e", "1;2", "--", "0,5", "1 2", "\xc2\xbd", "1e-3s", "+-1"});
    return name_of(*part);
  }
  std::string not_whole() {
    Part* part = part_of({Kind::whole});
    if (!part) return "";
    part->value += ".5";
    return name_of(*part);
  }
  std::string out_of_range() {
    Part* part = part_that([](const Part& p) { return !p.out_of_range.empty(); });
    if (!part) return "";
    part->value = pick(part->out_of_range);
    return name_of(*part);
  }
  std::string too_large() {
    Part* part = part_of({Kind::whole});
    if (!part) return "";
    part->value = pick({"99999999999999999999999", "-99999999999999999999999", "1e300"});
    return name_of(*part);
  }
  std::string empty_value() {
    Part* part = part_that([](const Part& p) { return takes_value(p); });
    if (!part) return "";
    part->value = "";
    return part->option + " = ''";
  }
  std::string problem_unknown() {
    Part* part = part_of({Kind::problem});
    if (!part) return "";
    part->value = misspelt(part->value, 1);
    return "'" + part->value + "': unknown; did you mean";
  }
  std::string experiment_unknown() {
    Part* part = part_of({Kind::experiment});
    if (!part) return "";
    part->value = misspelt("two_balls_order", 1);
    return "experiment = '" + part->value + "': unknown; did you mean|two_balls_order";
  }
  std::string method_unknown() {
    Part* part = part_of({Kind::method});
    if (!part) return "";
    std::string& text = part->value;
    const auto end = std::min(text.find_first_of(":,"), text.size());
    const std::string wrong = misspelt(text.substr(0, end), 1);
    text = wrong + text.substr(end);
    return "method = '" + wrong + "': unknown; did you mean";
  }
  std::string method_option_unknown() {
    Part* part = part_of({Kind::method});
    if (!part) return "";
    part->value += ",nonsense=1";
    return "'nonsense': unknown";
  }
  std::string method_value() {
    Part* part = part_of({Kind::method});
    if (!part || !part->value.starts_with("fesd:")) return "";
    const std::string option = pick({"n_fe=0", "n_fe=many", "n_fe=2.5", "max_elements=-1", "switches=all", "n_fe="});
    part->value += "," + option;
    return "fesd: " + option.substr(0, option.find('=')) + " = ";
  }
  std::string method_argument() {
    Part* part = part_of({Kind::method});
    if (!part) return "";
    part->value += pick({":7:8", ":x", ":"});
    return "method '" + part->value + "'";
  }
  std::string choice_unknown() {
    Part* part = part_of({Kind::choice});
    if (!part) return "";
    part->value = misspelt(part->value, 1);
    return part->value;
  }
  std::string view_unknown() {
    Part* part = part_of({Kind::view});
    if (!part) return "";
    part->value = misspelt(part->value, 1);
    return "'" + part->value + "': unknown; did you mean orders";
  }
  std::string parameter_unknown() {
    Part* part = part_of({Kind::change});
    if (!part) return "";
    part->value = part->value.substr(0, part->value.find('=')) + "kk" + part->value.substr(part->value.find('='));
    return "'" + part->value.substr(0, part->value.find('=')) + "': unknown; did you mean";
  }
  std::string parameter_value() {
    Part* part = part_of({Kind::change});
    if (!part) return "";
    part->value =
        part->value.substr(0, part->value.find('=')) + pick({"=", "=much", "", "=1;", "==1", "=nan", "=1e999"});
    return part->value.substr(0, part->value.find('='));
  }
  std::string parameter_twice() {
    Part* part = part_of({Kind::change});
    if (!part) return "";
    const std::string name = part->value.substr(0, part->value.find('='));
    insert(set(name + "=0.25"));
    return name + "=|given twice";
  }
  std::string vary_unknown() {
    Part* part = part_of({Kind::vary});
    if (!part) return "";
    const std::string name = pick({"kk", "q0:7", "v0:", "q0", "v0:x"});
    part->value = name + "=uniform:0:1";
    return name;
  }
  std::string vary_wrong() {
    Part* part = part_of({Kind::vary});
    if (!part) return "";
    part->value = "e=" + pick({"", "uniform", "uniform:0", "uniform:1:x", "normal:0:-1", "grid:0:1:0", "flat:0:1",
                               "log-uniform:-1:1", "values:"});
    return "e=";
  }
  std::string variable_unknown() {
    Part* part = part_of({Kind::variable});
    if (!part) return "";
    part->value = pick({"param:kk", "param:", "q0:99", "v0", "e", "q0:-1"});
    return "sensitivity = '" + part->value + "': unknown";
  }
  std::string setting_of_other_kind() {
    if (line_.setting_of_other_kind.empty()) return "";
    const auto space = line_.setting_of_other_kind.find(' ');
    const std::string option = line_.setting_of_other_kind.substr(0, space);
    insert({option, Kind::number, line_.setting_of_other_kind.substr(space + 1)});
    return option.substr(2);
  }
  std::string two_that_exclude() {
    static const std::map<std::string, Part> others = {{"--problem", in("--scene", "scene.json")},
                                                       {"--scene", {"--problem", Kind::problem, "bouncing_ball"}},
                                                       {"--steps", number("--step-length", "0.01", {})},
                                                       {"--baseline", in("--baselines", "folder")},
                                                       {"--write", out("--replace", "folder")}};
    Part* part = part_that([&](const Part& p) { return others.contains(p.option); });
    if (!part || (line_.command[0] != "run" && line_.command[0] != "audit" && line_.command[0] != "check")) return "";
    const Part other = others.at(part->option);
    insert(other);
    return other.option;
  }
  std::string file_missing() { return file_that(pick({"/nonexistent/file.json", "no_such_file", "a/b/c.jsonl"})); }
  std::string file_is_a_folder() { return file_that(pick({"/", "/usr", "."})); }
  std::string file_of_nothing() { return file_that("/dev/null"); }
  std::string file_of_noise() { return file_that(file_); }
  std::string file_that(const std::string& path) {
    Part* part = part_of({Kind::in, Kind::experiment});
    if (!part) return "";
    part->value = path;
    return path;
  }
  std::string out_below_a_file() {
    Part* part = part_of({Kind::out});
    if (!part) return "";
    part->value = file_ + "/" + part->value;
    return part->value;
  }
  std::string out_is_a_folder() {
    Part* part = part_that([](const Part& p) { return p.kind == Kind::out && p.value.find('.') != std::string::npos; });
    if (!part) return "";
    part->value = pick({"/", "/usr", "."});
    return part->option == "--tables" ? "" : part->value;
  }

  std::mt19937 random_;
  std::vector<Line> lines_;
  std::string file_;  ///< neither JSON nor a folder
  Line line_;
  std::vector<std::string> more_;
};

class CommandLines : public Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    const std::string experiment = write("small.json", kExperiment);
    write("study.json", R"({"problem": "two_balls_spring", "vary": ["e=grid:0.5:0.7:3"], "method": "moreau_jean",
        "steps": 100})");
    write("file", "\x01 no JSON {\n");
    clear();
    ASSERT_EQ(run("run-experiment " + experiment + " --quick --no-times -o " + (folder / "results").string()).code, 0);
    ASSERT_EQ(
        run("check " + (folder / "results/small.jsonl").string() + " --write " + (folder / "baseline.jsonl").string())
            .code,
        0);
  }
  /// The folder in which commands run has nothing in it but a folder for what they write.
  void clear() {
    fs::remove_all(folder / "here");
    fs::create_directories(folder / "here" / "out");
  }
  std::ptrdiff_t n_files() const {
    return std::ranges::count_if(fs::recursive_directory_iterator(folder / "here"),
                                 [](const auto& entry) { return !entry.is_directory(); });
  }
  /// The text is that of stderr.
  Outcome run_here(const std::vector<std::string>& words) {
    return output_of("cd " + (folder / "here").string() + " && timeout 20 " + RICOCHET_PROGRAM + quoted(words) +
                     " 2>&1 >/dev/null");
  }
};

TEST_F(CommandLines, GoodOnesRun) {
  for (const auto& line : good_lines(folder)) {
    const Outcome outcome = run_here(line.words());
    EXPECT_EQ(outcome.code, 0) << quoted(line.words()) << "\n" << outcome.text;
    clear();
  }
}

TEST_F(CommandLines, EachWithAMistakeIsRefusedWithItsPlace) {
  Spoiler spoiler(kSeed, folder);
  std::set<std::vector<std::string>> lines;
  for (int k = 0; k < kLines; ++k) {
    // Some kinds of mistakes have few lines; the next kind takes their turn.
    BadLine bad;
    for (int attempt = 0; attempt == 0 || !lines.insert(bad.words).second; ++attempt)
      bad = spoiler.spoil(static_cast<std::size_t>(k + attempt / 10) % Spoiler::kinds().size());
    const Outcome outcome = run_here(bad.words);
    const std::string message = dashed(outcome.text);
    EXPECT_EQ(outcome.code, 2) << quoted(bad.words) << "\n" << outcome.text;
    std::istringstream places(bad.place);
    for (std::string place; std::getline(places, place, '|');)
      EXPECT_NE(message.find(dashed(place)), std::string::npos)
          << "expected " << place << "\nin       " << outcome.text << "\n"
          << quoted(bad.words);
    EXPECT_TRUE(n_files() == 0) << "a file was written:" << quoted(bad.words);
    clear();
  }
}

}  // namespace
}  // namespace ricochet::cli
