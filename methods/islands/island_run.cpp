#include "methods/islands/island_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "methods/islands/joined_parts.h"
#include "methods/time_limit.h"
#include "problems/run_pieces.h"

namespace ricochet {
namespace {

constexpr int kFewCoordinates = 100;                          // up to which one run of the whole is as fast
constexpr double kFirstLength = 1.0 / 128, kFirstRate = 100;  // of the end time; steps per coordinate in it
constexpr double kLast = 1.25;                                // lengths, of a window that may go on to the end time
constexpr double kMoves = 10;                                 // tolerances, by which instants may move coordinates
constexpr double kShortest = 1e-12;                           // of the end time

}  // namespace

bool IslandRun::is_worth_it(const Problem& problem) {
  return problem.n_q() > kFewCoordinates && problem.part({}, {}) != nullptr;
}

bool IslandRun::can_divide(const Settings& settings) {
  return settings.sensitivities.empty() && !settings.stays_in_region && settings.until == nullptr && !settings.ends &&
         settings.reached == nullptr;
}

IslandRun::IslandRun(const Problem& problem, Prepare prepare)
    : problem_(problem), info_(problem.info()), prepare_(std::move(prepare)), plan_(problem) {}

void IslandRun::begin() {
  total_ = {};
  total_.q = info_.q0;
  total_.v = info_.v0;
  modes_.clear();
  parts_.clear();
  last_parts_.clear();
  plan_.restart();
  T_ = info_.end_time;
  H_ = kFirstLength * T_;
  rate_ = kFirstRate / T_;
  may_grow_ = true;
}

/// The length of the next window, with its parts in plan_.
double IslandRun::choose_length() {
  const double rest = T_ - total_.t;
  double best = 0, least = std::numeric_limits<double>::infinity(), divided = 0;
  for (const double factor : {2.0, 1.0, 0.5}) {
    if (factor > 1 && !may_grow_) continue;
    const double H = kLast * factor * H_ >= rest ? rest : factor * H_;
    if (H == divided) continue;
    plan_.divide(total_.q, total_.v, divided = H, kMoves * tolerance_);
    const double work = plan_.work_rate(rate_);
    if (work >= least) continue;
    best = H;
    least = work;
  }
  if (divided != best) plan_.divide(total_.q, total_.v, best, kMoves * tolerance_);
  return best;
}

/// (2) of one part, over `length` [s].
void IslandRun::run(const WindowPlan::Part& members, double length, const Settings& settings) {
  auto [at, is_new] = parts_.try_emplace(members);
  Part& part = at->second;
  if (const auto last = last_parts_.find(members); is_new && last != last_parts_.end())
    part = std::move(last->second);
  else if (is_new)
    part.problem = problem_.part(members.coordinates, members.contacts);
  Vector q = total_.q(members.coordinates), v = total_.v(members.coordinates);
  if (!modes_.empty() && !members.contacts.empty()) {
    std::vector<ContactMode> modes;
    std::vector<char> sticks;
    for (const int i : members.contacts) {
      modes.push_back(modes_[static_cast<std::size_t>(i)]);
      sticks.push_back(modes.back() == ContactMode::stick && info_.contacts[static_cast<std::size_t>(i)].n_t == 1);
    }
    hold_closed(*part.problem, modes, sticks, q, v);
  }
  part.problem->set_initial_state(q, v);
  part.problem->set_end_time(length);
  if (!part.solver) part.solver = prepare_(*part.problem);
  if (!part.solver) throw std::logic_error("a method with MethodInfo::has_islands has no Solver");
  part.reached.clear();
  for (const double x : q) part.reached.emplace_back(x);
  Settings of_part = settings;
  of_part.recording = settings.recording >= Recording::events ? Recording::motion : Recording::events;
  of_part.begin = total_.t;
  of_part.reached = &part.reached;
  part.solution = part.solver->solve(of_part);
}

/// (2) of all parts. False when the time is over.
bool IslandRun::run_parts(double H, const Settings& settings) {
  const TimeLimit limit(settings.time_limit);
  Settings with_rest = settings;
  parts_.clear();
  for (const WindowPlan::Part& members : plan_.parts()) {
    if (settings.time_limit > 0) {
      if (limit.left() <= 0) return false;
      with_rest.time_limit = limit.left();
    }
    run(members, H, with_rest);
    if (parts_.at(members).solution.status == Status::time_limit) return false;
  }
  return true;
}

/// (3)
bool IslandRun::stays_in_box() const {
  return std::ranges::all_of(parts_, [&](const auto& entry) {
    const auto& [members, part] = entry;
    for (std::size_t k = 0; k < members.coordinates.size(); ++k) {
      const Interval& box = plan_.box()[static_cast<std::size_t>(members.coordinates[k])];
      if (!box.contains(part.reached[k]) || !box.contains(part.solution.q[static_cast<Eigen::Index>(k)])) return false;
    }
    return true;
  });
}

/// Whether a part has failed: then the others are taken up to that time, and the run ends with its status.
bool IslandRun::stop_at_failure(const Settings& settings) {
  const Solution* first = nullptr;
  for (const auto& [members, part] : parts_) {
    const bool is_first = !part.solution.succeeded() && (first == nullptr || part.solution.t < first->t);
    if (is_first) first = &part.solution;
  }
  if (first == nullptr) return false;
  const Solution failed = *first;
  for (auto& [members, part] : parts_) {
    if (failed.t > 0 && part.solution.t > failed.t) run(members, failed.t, settings);
  }
  const auto is_there = [&](const auto& entry) { return entry.second.solution.t >= failed.t; };
  if (failed.t > 0 && std::ranges::all_of(parts_, is_there)) take(failed.t, settings.recording);
  total_.status = failed.status;
  total_.message = failed.message;
  total_.reason = failed.reason;
  return true;
}

/// Ends the run where the window begins.
void IslandRun::stop(Status status, const std::string& message) {
  total_.status = status;
  total_.message = fmt::format("at t = {:.6g} s: {}", total_.t, message);
}

/// Adds the window to the run.
void IslandRun::take(double H, Recording recording) {
  std::vector<PartSolution> parts;
  for (const auto& [members, part] : parts_) parts.push_back({members, part.solution});
  Solution window = joined(info_, parts, H, recording);
  if (!total_.samples.empty())  // the end of the last window is one of its samples
    std::erase_if(window.samples, [](const Sample& s) { return s.t == 0 && s.v_minus == s.v_plus; });
  auto modes = joined_modes(info_, parts);
  append(info_, std::move(window), total_, modes_);
  modes_ = std::move(modes);
}

/// Adds the counters of the last runs, and updates the rate of steps. Of runs that are repeated, only their work counts.
void IslandRun::count(double H, bool is_repeated) {
  double steps = 0, coordinates = 0;
  for (const auto& [members, part] : parts_) {
    Counters counters = part.solution.counters;
    if (is_repeated) counters.steps = counters.elements = counters.events = 0;
    add_counters(counters, total_.counters);
    if (members.contacts.empty()) continue;
    steps += static_cast<double>(part.solution.counters.steps);
    coordinates += static_cast<double>(members.coordinates.size());
  }
  if (coordinates > 0) rate_ = 0.5 * (rate_ + steps / (coordinates * H));
}

Solution IslandRun::solve(const Settings& settings) {
  begin();
  tolerance_ = settings.tolerance;
  const TimeLimit limit(settings.time_limit);
  Settings with_rest = settings;
  while (total_.t < T_) {
    if (settings.time_limit > 0) with_rest.time_limit = std::max(1e-9, limit.left());
    const double H = choose_length();
    const bool has_time = run_parts(H, with_rest);
    const bool is_repeated = !has_time || !stays_in_box();
    count(H, is_repeated);
    if (!has_time) {
      stop(Status::time_limit, limit.message());
      break;
    }
    if (is_repeated && H <= kShortest * T_) {
      stop(Status::inner_solver_failed, "bodies move farther than their energy explains");
      break;
    }
    if (is_repeated) {
      H_ = 0.5 * H;
      may_grow_ = false;
      last_parts_.swap(parts_);
      continue;
    }
    if (stop_at_failure(with_rest)) break;
    take(H, settings.recording);
    if (total_.t > T_ * (1 - kShortest)) total_.t = T_;
    H_ = H;
    may_grow_ = true;
    last_parts_.swap(parts_);
  }
  return std::move(total_);
}

}  // namespace ricochet
