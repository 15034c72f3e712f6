#include "reference/certified/hybrid_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ricochet::reference::certified {
namespace {

constexpr double kWidest = -3;         // log10 of the radius of a state beyond which nothing is decided any more
constexpr int kSpareDigits = 15;       // significant digits beyond the decimal places that are wanted
constexpr int kMostTrials = 60;        // lengths of one step
constexpr double kShortFlight = 1e-3;  // of a step, so that a root is hard to find in it
constexpr double kFlights = 3;         // length of the step then
constexpr slong kRoomBits = 6;         // of balls in a certificate, beyond rounding
constexpr int kRemainderRoom = 2;      // bits
constexpr slong kImpulseShare = 4;     // of impulses in a certificate: 2^-4 of the radius

std::string short_text(const Ball& ball) {
  char* const text = arb_get_str(ball.get(), 12, ARB_STR_NO_RADIUS);
  std::string result = text;
  flint_free(text);
  return result;
}

std::string exact_text(const Ball& ball) {
  char* const text = arb_dump_str(ball.get());
  std::string result = text;
  flint_free(text);
  return result;
}

/// Adds 2^-shift of the radius, and some roundings of the size of the midpoint.
void widen(Ball& x, slong bits, slong shift) {
  Magnitude extra(x), share;
  mag_mul_2exp_si(extra.get(), extra.get(), kRoomBits - bits);
  mag_mul_2exp_si(share.get(), arb_radref(x.get()), -shift);
  mag_add(extra.get(), extra.get(), share.get());
  x.widen(extra.get());
}

/// Rounds up to 24 bits, so that powers of h stay short.
double short_length(double h) {
  int exponent = 0;
  const double mantissa = std::frexp(h, &exponent);
  return std::ldexp(std::ceil(std::ldexp(mantissa, 24)), exponent - 24);
}

}  // namespace

HybridMotion::HybridMotion(SceneFormulas formulas, SeriesProgram& program, const Options& options,
                           const TimeLimit& limit, int cut)
    : scene_(std::move(formulas)),
      p_(program),
      options_(options),
      limit_(limit),
      cut_(cut),
      taylor_(scene_, program, limit),
      set_(scene_, program, taylor_, options.mean_value_form),
      decisions_(scene_, program, taylor_, limit),
      states_(scene_.n_c()) {
  result_.grade = Grade::proven;
  if (options.with_steps) taylor_.leave_room(kRemainderRoom);
  if (!scene_.borders.empty()) result_.no_certificate = "a formula bends or jumps";
  if (std::ranges::any_of(scene_.contacts, &ContactFormulas::mu_varies))
    result_.no_certificate = "a friction coefficient depends on the place or the time";
}

void HybridMotion::assume(const std::string& what) {
  result_.assumptions.push_back(what);
  result_.grade = std::max(result_.grade, Grade::assumed);
}

/// Records a number that is taken as zero without a proof. The grade is `computed` from now on.
void HybridMotion::take_as_zero(const std::string& what) {
  result_.assumptions.push_back(fmt::format("{}, below 1e-{}, at t = {}", what, cut_, short_text(t_)));
  result_.grade = Grade::computed;
  refuse_sensitivities("the motion is computed, not proven");
  result_.no_certificate = "the motion is computed, not proven";
}

void HybridMotion::refuse_sensitivities(const std::string& reason) {
  if (sensitivities_) sensitivities_->refuse(reason);
}

void HybridMotion::begin() {
  has_begun_ = true;
  std::vector<Ball> x = set_.box();
  taylor_.load(x, t_);
  const StartingContacts start = decisions_.contacts_at_start(states_);
  for (const auto& assumption : start.assumptions) assume(assumption);
  if (start.hit.empty()) {
    decisions_.decide_modes(x, t_, start.touching, start.slip_sign, states_);
    if (sensitivities_) sensitivities_->start(states_, x);
  } else {
    refuse_sensitivities("an impact at t = 0");
    const ImpactOutcome outcome = decisions_.strike(x, t_, start.candidates(), start.closed(scene_.n_c()), states_);
    keep_impact(std::move(x), outcome, scene_.contacts[start.hit.front()].name);
    if (leaves_region()) return;
  }
  begin_motion();
}

void HybridMotion::begin_motion() {
  require_bounds(scene_, states_.modes);
  taylor_.load(set_.box(), t_);
  motion_ = mode_motion(scene_, states_.modes, p_, states_.starting, states_.left_out);
  if (std::ranges::count(states_.sticks_at_limit, 1) > 0) result_.no_certificate = "friction in space is at its limit";
  for (const auto& [contact, onset] : states_.starting) {
    result_.no_certificate = "slip in space begins from rest";
    if (onset.order > 1) set_.take_mean_value_form();  // friction is stiff then, and boxes grow
  }
  set_.begin(motion_);
  if (sensitivities_) sensitivities_->begin(states_, motion_, set_.box(), t_);
  for (const int i : decisions_.sticking_in_space()) {
    const std::string text = fmt::format("{} sticks; slip in space from rest is not refuted", scene_.contacts[i].name);
    if (std::ranges::count(result_.assumptions, text) == 0) assume(text);
  }
}

bool HybridMotion::impacts_accumulate() const {
  constexpr std::size_t kMany = 16, kLast = 8;
  constexpr double kShort = 1e-6;  // of the end time
  const std::size_t n = event_times_.size();
  if (n < kMany) return false;
  return event_times_[n - 1].nearest() - event_times_[n - kLast].nearest() < kShort * scene_.end_time.nearest();
}

void HybridMotion::run() {
  try {
    run_to_end();
  } catch (const Undecided& error) {
    const bool may_pass = scene_.n_c() > 0 && (may_collapse(last_impact_) || may_collapse_with_another(last_impact_));
    if (cut_ > 0 || !impacts_accumulate() || may_pass) throw;  // more bits reach smaller speeds
    throw Unsupported(fmt::format("impacts accumulate at t = {}", short_text(t_)));
  }
}

void HybridMotion::run_to_end() {
  constexpr double kStiffLoss = 8;  // slow slip in space is stiff: the mean value form keeps digits that boxes lose
  const auto lost_digits = [&] {
    double worst = -1e9;
    for (const Ball& x : set_.box()) worst = std::max(worst, x.log10_radius());
    return worst + static_cast<double>(p_.precision().bits) * std::log10(2.0);
  };
  if (!has_begun_) begin();
  for (bool is_last = false; !is_last && !exit_;) {
    limit_.check();
    for (const Ball& x : set_.box()) {
      if (!(x.log10_radius() < kWidest))
        throw Undecided(fmt::format("the enclosure is too wide at t = {}", short_text(t_)));
    }
    leave_room();
    const bool slips_in_space = std::ranges::count(states_.modes, Mode::slip) > 0;
    if (slips_in_space && !options_.with_steps && !set_.mean_value_form() && lost_digits() > kStiffLoss) {
      set_.take_mean_value_form();
      set_.begin(motion_);
    }
    for (int i = 0; i < scene_.n_c(); ++i) {
      if (states_.modes[i] == Mode::slip && states_.starting.count(i) == 0) pass_slip_end(i);
    }
    const Step step = find_step();
    is_last = step.is_last;
    for (const int i : step.grazing) take_as_zero(fmt::format("the gap of {} touches zero", scene_.contacts[i].name));
    ++result_.n_steps;
    if (options_.with_steps) keep(step);
    if (step.reached.size() > 1 && !step.is_tied) {
      handle_decoupled_impacts(step);
      continue;
    }
    const bool has_started_slip = !states_.starting.empty();
    advance(step);
    if (has_started_slip && step.reached.empty()) begin_motion();
    if (step.is_tied)
      handle_tied_impacts(step);
    else if (!step.reached.empty())
      handle(EventFunction(motion_.events[step.reached.front()]));
  }
  require_bounds(scene_, states_.modes);
  if (exit_) return;
  leave_room();
  if (sensitivities_) sensitivities_->finish(set_.box(), t_);
}

/// In a certificate every set is wider than the result of the step before, so that a checker that rounds in another
/// way, or bounds remainders in another way, finds its own result inside.
void HybridMotion::leave_room() {
  if (!options_.with_steps || set_.mean_value_form()) return;
  constexpr slong kShare = 20;
  const slong bits = p_.precision().bits;
  std::vector<Ball> box = set_.box();
  for (int k = 0; k < 2 * scene_.n; ++k) {
    widen(box[k], bits, kShare);
    Magnitude remainder;
    mag_mul_2exp_si(remainder.get(), p_.rho(k < scene_.n ? scene_.q[k] : scene_.v[k - scene_.n]), 1);
    box[k].widen(remainder.get());
  }
  set_.set_box(std::move(box));
  widen(t_, bits, kShare);
}

void HybridMotion::advance(const Step& step) {
  if (sensitivities_) sensitivities_->move(set_.box(), t_, p_.precision().mul(step.end, Ball(step.h)));
  set_.advance(motion_, t_, step.h, step.end, !step.reached.empty());
  const Precision& a = p_.precision();
  t_ = a.add(t_, a.mul(step.end, Ball(step.h)));
  states_.moved();
}

/// Goes on after a window [t, t + w], at whose end `box` contains the motion. @param event  it happens until t + event
void HybridMotion::pass_window(const std::vector<Ball>& box, const Ball& w, const Ball& event,
                               const std::vector<Mode>& modes, const std::string& kind, const std::string& contact) {
  const Precision& a = p_.precision();
  refuse_sensitivities(kind + " within a window: " + contact);
  const Ball begin = t_;
  set_.set_box(box);
  states_.modes = modes;
  states_.moved();
  t_ = a.add(begin, a.hull(Ball(), event));
  record(kind, contact);
  t_ = a.add(begin, w);
}

/// An estimate of the next time at which a gap closes, from its first three coefficients [s].
double HybridMotion::shortest_flight() const {
  double shortest = std::numeric_limits<double>::infinity();
  for (const EventFunction& event : motion_.events) {
    if (event.kind != EventKind::impact || p_.is_constant(event.node)) continue;
    if (states_.vanishing_gap[event.contact] > 1) continue;
    const auto coefficient = [&](int k) { return Ball(p_.coefficient(event.node, k)).nearest(); };
    const double gap = states_.vanishing_gap[event.contact] > 0 ? 0 : coefficient(0);
    const double rate = coefficient(1), bend = coefficient(2);
    const double discriminant = rate * rate - 4 * bend * gap;
    if (!(discriminant >= 0)) continue;
    const double sum = std::abs(rate) + std::sqrt(discriminant);
    for (const double root : {2 * gap / (rate < 0 ? sum : -sum), (rate < 0 ? sum : -sum) / (2 * bend)}) {
      if (root > 0) shortest = std::min(shortest, root);
    }
  }
  return shortest;
}

HybridMotion::Step HybridMotion::find_step() {
  set_.expand(motion_, t_);
  const Ball left = p_.precision().sub(scene_.end_time, t_);
  if (left.sign() != Sign::positive) throw Undecided("an event at the end time");
  const double longest = left.nearest() * (1 + 1e-9) + 1e-300;
  double h = std::min(taylor_.suggested_length(motion_), longest);
  if (const double flight = shortest_flight(); flight < kShortFlight * h) h = kFlights * flight;
  std::string reason = "no step";
  for (int trial = 0; trial < kMostTrials; ++trial, h *= trial < 3 ? 0.9 : 0.6) {
    limit_.check();
    Step step;
    if (!try_step(short_length(h), step, reason)) continue;
    constexpr slong kShare = 4, kShareOfSlip = -2;  // slip velocities here leave out those that contacts lock
    const bool ends_slip = !step.reached.empty() && motion_.events[step.reached[0]].kind == EventKind::slip_end;
    if (options_.with_steps && (step.is_last || !step.reached.empty()))
      widen(step.end, p_.precision().bits, ends_slip ? kShareOfSlip : kShare);
    return step;
  }
  throw Undecided(fmt::format("no step at t = {}: {}", short_text(t_), reason));
}

bool HybridMotion::try_step(double h, Step& step, std::string& reason) {
  step = {};
  step.h = h;
  step.end = Ball(1.0);
  if (!set_.validate(motion_, h)) {
    reason = "the remainder of the series is not proven";
    return false;
  }
  const Ball left = p_.precision().sub(scene_.end_time, t_), length(h);
  if (h >= left.nearest()) {
    if (p_.precision().sub(length, left).sign() != Sign::positive) {
      reason = "the end time cannot be told from the end of the step";
      return false;
    }
    step.end = p_.precision().div(left, length);
    step.is_last = true;
  }
  return find_events(h, Ball(step.end), step, reason);
}

std::string HybridMotion::name_of_event(const EventFunction& event) const {
  static const char* const names[] = {"impact", "detach", "end of slip", "friction limit"};
  if (event.kind == EventKind::border) return fmt::format("{} = 0", scene_.borders[event.border].formula);
  return fmt::format("{} of {}", names[static_cast<int>(event.kind)], scene_.contacts[event.contact].name);
}

bool HybridMotion::find_events(double h, const Ball& end, Step& step, std::string& reason) {
  std::vector<std::pair<std::size_t, Ball>> roots;
  for (std::size_t k = 0; k < motion_.events.size(); ++k) {
    const EventFunction& event = motion_.events[k];
    const bool is_bounded_only = event.kind == EventKind::impact && states_.gap_is_bounded_only[event.contact];
    int vanishing = event.kind == EventKind::impact     ? states_.vanishing_gap[event.contact]
                    : event.kind == EventKind::slip_end ? states_.vanishing_slip[event.contact]
                    : event.kind == EventKind::cone     ? states_.sticks_at_limit[event.contact]
                    : event.kind == EventKind::border   ? states_.vanishing_border[event.border]
                                                        : 0;
    const int expected = vanishing;
    vanishing = p_.leading(event.node, vanishing, p_.precision().order);
    if (vanishing > expected) refuse_sensitivities(name_of_event(event) + ": it vanishes to a higher order");
    BoundedPolynomial f;
    taylor_.polynomial(f, event.node, h, vanishing);
    Ball first;
    arb_poly_get_coeff_arb(first.get(), f.p, 0);
    if (first.sign() != Sign::positive)
      throw Undecided(fmt::format("{}: undecided whether it happens at t = {}", name_of_event(event), short_text(t_)));
    const bool may_graze = cut_ > 0 && event.kind == EventKind::impact;
    const FirstRoot root = first_root(f, end, p_.precision(), may_graze ? std::pow(10., -cut_) : 0);
    if (root.grazes) step.grazing.push_back(event.contact);
    if (root.kind == FirstRoot::Kind::unknown || (is_bounded_only && root.kind == FirstRoot::Kind::found)) {
      reason = fmt::format("{}: {}", name_of_event(event), *root.reason ? root.reason : "an impact at once");
      return false;
    }
    if (root.kind == FirstRoot::Kind::found) roots.emplace_back(k, root.root);
  }
  if (roots.empty()) return true;
  const auto is_before = [](const auto& a, const auto& b) {
    return arf_cmp(arb_midref(a.second.get()), arb_midref(b.second.get())) < 0;
  };
  const auto first = *std::ranges::min_element(roots, is_before);
  step.end = first.second;
  step.is_last = false;
  step.reached.push_back(first.first);
  for (const auto& [k, root] : roots) {
    if (k == first.first || arb_lt(first.second.get(), root.get())) continue;
    step.reached.push_back(k);
    step.end = p_.precision().hull(step.end, root);
  }
  if (step.reached.size() > 1 && are_tied_impacts(step.reached, h)) {
    step.is_tied = true;
    step.end = first.second;
  } else if (step.reached.size() > 1 && !are_decoupled_impacts(step)) {
    throw Undecided(fmt::format("{} and {} at the same time, t = {}", name_of_event(motion_.events[step.reached[0]]),
                                name_of_event(motion_.events[step.reached[1]]),
                                short_text(p_.precision().add(t_, p_.precision().mul(step.end, Ball(h))))));
  }
  return true;
}

void HybridMotion::keep(const Step& step) {
  CertifiedStep kept;
  kept.n_events = static_cast<int>(result_.events.size());
  kept.time = exact_text(t_);
  kept.length = step.h;
  kept.end = exact_text(step.end);
  kept.modes = names_of(states_.modes);
  for (const Ball& x : set_.box()) kept.state.push_back(exact_text(x));
  for (const auto* variables : {&scene_.q, &scene_.v}) {
    for (const Node node : *variables) {
      Magnitude rho;
      mag_set(rho.get(), p_.rho(node));
      kept.remainders.push_back(rho.upper());
    }
  }
  result_.steps.push_back(std::move(kept));
}

double HybridMotion::log10_radius() const {
  double worst = sensitivities_ ? sensitivities_->log10_radius() : -1e9;
  for (const Ball& x : set_.box()) worst = std::max(worst, x.log10_radius());
  if (exit_) worst = std::max(worst, t_.log10_radius());
  for (const Ball& t : event_times_) worst = std::max(worst, t.log10_radius());
  return worst;
}

CertifiedMotion HybridMotion::result() const {
  CertifiedMotion result = result_;
  const auto number = [&](const Ball& ball) {
    const Decimal d = decimal(ball, options_.digits + kSpareDigits);
    return CertifiedNumber{d.text, d.radius, d.decimals};
  };
  for (int k = 0; k < scene_.n_bodies; ++k) result.q.push_back(number(set_.box()[k]));
  for (int k = 0; k < scene_.n_bodies; ++k) result.v.push_back(number(set_.box()[scene_.n + k]));
  for (std::size_t k = 0; k < event_times_.size(); ++k) result.events[k].time = number(event_times_[k]);
  result.end_time = number(t_);
  if (sensitivities_) sensitivities_->write(result, options_.digits + kSpareDigits);
  if (options_.with_steps) std::ranges::transform(set_.box(), std::back_inserter(result.final_state), exact_text);
  result.modes = names_of(states_.modes);
  result.bits = p_.precision().bits;
  result.order = p_.precision().order;
  result.mean_value_form = set_.mean_value_form();
  return result;
}

void HybridMotion::record(const std::string& kind, const std::string& contact, const std::vector<Ball>& Lambda_n) {
  CertifiedEvent event;
  event.kind = kind;
  event.contact = contact;
  event.modes = names_of(states_.modes);
  event.grade = result_.grade;
  for (Ball impulse : Lambda_n) {
    if (options_.with_steps && !impulse.is_zero()) widen(impulse, p_.precision().bits, kImpulseShare);
    const Decimal d = decimal(impulse, options_.digits + kSpareDigits);
    event.Lambda_n.push_back({d.text, d.radius, d.decimals});
  }
  result_.events.push_back(std::move(event));
  event_times_.push_back(t_);
}

}  // namespace ricochet::reference::certified
