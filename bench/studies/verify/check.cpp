#include "bench/studies/verify/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "methods/isolated.h"

namespace ricochet {

using nlohmann::json;

const char* to_string(CheckVerdict verdict) {
  switch (verdict) {
    case CheckVerdict::pass:
      return "pass";
    case CheckVerdict::fail:
      return "fail";
    case CheckVerdict::not_applicable:
      return "not applicable";
  }
  return "";
}

CheckResult CheckResult::pass(std::string reason, std::string command) {
  return {CheckVerdict::pass, std::move(reason), std::move(command)};
}
CheckResult CheckResult::fail(std::string reason, std::string command) {
  return {CheckVerdict::fail, std::move(reason), std::move(command)};
}
CheckResult CheckResult::not_applicable(std::string reason) {
  return {CheckVerdict::not_applicable, std::move(reason), ""};
}
CheckResult CheckResult::not_judged(const std::string& reason) {
  return {CheckVerdict::not_applicable, "not judged: " + reason, "", false};
}

Setting Subject::setting(int first_order_steps, int high_order_steps, double tolerance) const {
  return info.is_adaptive ? Setting{0, tolerance}
                          : Setting{steps(is_first_order() ? first_order_steps : high_order_steps), 0};
}

int Subject::steps(double usual) const {
  return std::max(1, static_cast<int>(std::lround(usual * step_factor)));
}

const Problem& KnownProblem::problem() const {
  if (!problem_) problem_ = choice_.make_problem();
  return *problem_;
}

const reference::Reference& KnownProblem::reference() const {
  if (!reference_) reference_ = choice_.make_reference(problem(), sensitivities_);
  return *reference_;
}

CheckRow run_check(const Check& check, const Subject& subject) {
  if (check.prepare) check.prepare();
  const auto begin = std::chrono::steady_clock::now();
  const IsolatedResult answer =
      run_isolated([&] { return json(check.run(subject)).dump(-1, ' ', false, json::error_handler_t::replace); },
                   subject.time_limit);
  CheckRow row;
  row.method = subject.spec;
  row.group = check.group;
  row.check = check.name;
  row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  CheckResult& result = row;
  switch (answer.ending) {
    case IsolatedResult::Ending::returned:
      result = json::parse(answer.text).get<CheckResult>();
      break;
    case IsolatedResult::Ending::killed:
      result = CheckResult::fail(fmt::format("no answer within {:g} s", subject.time_limit));
      break;
    case IsolatedResult::Ending::crashed:
      result = CheckResult::fail("it ended with: " + answer.text);
      break;
  }
  return row;
}

}  // namespace ricochet
