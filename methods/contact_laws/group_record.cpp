#include "methods/contact_laws/group_record.h"

#include <fmt/format.h>

#include <algorithm>

namespace ricochet {
namespace {

constexpr int kMostRefusals = 100;
constexpr double kNoProgress = 1e-12;  // of the end time: 100 instants, each of what time can resolve

}  // namespace

GroupRecord::GroupRecord(const ProblemInfo& problem) : problem_(problem) {}

bool GroupRecord::add(double t, const GroupInstant& instant, Solution& solution) {
  if (instant.capture.n_contacts > 0) {
    solution.captures.push_back(instant.capture);
    solution.captures.back().t = t;
  }
  if (!instant.wedge.empty()) is_in_one_.resize(problem_.contacts.size(), 0);  // most runs have none
  const auto is_new = [&](int i) { return is_in_one_[static_cast<std::size_t>(i)] == 0; };
  if (std::ranges::any_of(instant.wedge, is_new)) {
    solution.wedges.push_back({t, instant.wedge});
    for (const int i : instant.wedge) is_in_one_[static_cast<std::size_t>(i)] = 1;
  }
  if (t > mark_ + kNoProgress * problem_.end_time) {
    mark_ = t;
    refusals_ = 0;
  }
  if (instant.refused.empty()) return true;
  refused_ = instant.refused;
  rates_ = instant.rates;
  return ++refusals_ < kMostRefusals;
}

std::string GroupRecord::message(double begin) const {
  std::string names;
  for (std::size_t k = 0; k < refused_.size(); ++k)
    names += fmt::format("{}'{}' ({:.3g} m/s)", k == 0 ? "" : ", ",
                         problem_.contacts[static_cast<std::size_t>(refused_[k])].name, rates_[k]);
  return fmt::format("a group of contacts neither comes to rest nor parts, {} times since t = {:.12g} s: {}", refusals_,
                     begin + mark_, names);
}

FailureReason GroupRecord::reason() const {
  FailureReason reason{.code = FailureCode::impacts_accumulate};
  for (const int i : refused_) reason.contacts.push_back(problem_.contacts[static_cast<std::size_t>(i)].name);
  return reason;
}

}  // namespace ricochet
