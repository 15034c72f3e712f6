#include "reference/certified/certificate_checker.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/sha256.h"

namespace ricochet::reference::certified {
namespace {

constexpr long kMostBits = 200000;
constexpr int kMostOrder = 100000;
constexpr int kMostBisections = 60;

Precision precision_of(const Certificate& c) {
  if (c.bits < 2 || c.bits > kMostBits)
    throw Refused(fmt::format("bits = {} are not between 2 and {}", c.bits, kMostBits));
  if (c.order < 4 || c.order > kMostOrder)
    throw Refused(fmt::format("order = {} is not between 4 and {}", c.order, kMostOrder));
  return {static_cast<slong>(c.bits + CertificateChecker::kMoreBits), c.order};
}

std::vector<Ball> balls_of(const std::vector<std::string>& texts, std::size_t size, const char* what) {
  if (texts.size() != size) throw Refused(fmt::format("{} has {} numbers in place of {}", what, texts.size(), size));
  std::vector<Ball> balls;
  for (const auto& text : texts) balls.push_back(ball_of_text(text));
  return balls;
}

bool contains(const Ball& outer, const Ball& inner) {
  return arb_is_finite(outer.get()) != 0 && arb_contains(outer.get(), inner.get()) != 0;
}

/// Whether f > 0 on [begin, end], which lies in [0, 1]: by bisection until f is monotone or its range is positive.
bool stays_positive(const BoundedPolynomial& f, const Ball& begin, const Ball& end, const Precision& a, int depth = 0) {
  const Ball I = a.hull(begin, end), middle = I.midpoint();
  Ball slope;
  arb_poly_evaluate(slope.get(), f.slope, I.get(), a.bits);
  if (slope.sign() == Sign::negative) return f.at(end, a.bits).sign() == Sign::positive;
  if (slope.sign() == Sign::positive) return f.at(begin, a.bits).sign() == Sign::positive;
  if (f.at(I, a.bits).sign() == Sign::positive) return true;
  if (a.add(f.at(middle, a.bits), a.mul(a.sub(I, middle), slope)).sign() == Sign::positive) return true;
  if (depth == kMostBisections) return false;
  return stays_positive(f, begin, middle, a, depth + 1) && stays_positive(f, middle, end, a, depth + 1);
}

/// Whether the first root of f lies in `root`: f > 0 up to an interval around it with f' < 0, f < 0 at its end, and
/// Newton's operator maps that interval into `root`.
bool has_first_root(const BoundedPolynomial& f, const Ball& root, const Precision& a) {
  constexpr int kWiden = 6, kMostTrials = 12;  // from 64 radii on
  const Ball middle = root.midpoint(), one(1.0);
  for (int trial = 0; trial < kMostTrials; ++trial) {
    Magnitude width(middle);
    mag_mul_2exp_si(width.get(), width.get(), -a.bits);
    mag_add(width.get(), width.get(), arb_radref(root.get()));
    mag_mul_2exp_si(width.get(), width.get(), kWiden * (trial + 1));
    Ball w, I = middle, slope;
    arf_set_mag(arb_midref(w.get()), width.get());
    I.widen(width.get());
    const Ball begin = a.sub(middle, w).midpoint(), end = a.add(middle, w).midpoint();
    if (begin.sign() != Sign::positive || arb_gt(end.get(), one.get())) return false;
    I = a.hull(begin, end);
    arb_poly_evaluate(slope.get(), f.slope, I.get(), a.bits);
    if (slope.sign() != Sign::negative) return false;
    if (f.at(end, a.bits).sign() != Sign::negative || f.at(begin, a.bits).sign() != Sign::positive) continue;
    const Ball newton = a.sub(middle, a.div(f.at(middle, a.bits), slope));
    return contains(root, newton) && stays_positive(f, Ball(), begin, a);
  }
  return false;
}

std::string names(const std::vector<std::string>& modes) {
  return fmt::format("{}", fmt::join(modes, ", "));
}

void require_modes(const std::vector<Mode>& found, const std::vector<std::string>& stated) {
  if (names_of(found) != stated)
    throw Refused(fmt::format("the modes are {}, not {}", names(names_of(found)), names(stated)));
}

}  // namespace

Ball ball_of_text(const std::string& text) {
  Ball ball;
  if (arb_load_str(ball.get(), text.c_str()) != 0) throw InputError(fmt::format("'{}' is no ball", text));
  return ball;
}

CertifiedNumber stated_number(const Ball& ball, int digits) {
  constexpr int kSpareDigits = 15;
  const Decimal d = decimal(ball, digits + kSpareDigits);
  return {d.text, d.radius, d.decimals};
}

CertificateChecker::CertificateChecker(const Certificate& certificate, const TimeLimit& limit)
    : certificate_(certificate),
      limit_(limit),
      problem_(read_scene_text(certificate.scene, "scene of the certificate")),
      p_(precision_of(certificate)),
      scene_(scene_formulas(*problem_, certificate.reading, p_)),
      taylor_(scene_, p_, limit),
      decisions_(scene_, p_, taylor_, limit),
      states_(scene_.n_c()),
      x_(scene_.start) {
  if (sha256(certificate.scene) != certificate.scene_hash) throw Refused("the scene is not that of its hash");
}

void CertificateChecker::run() {
  begin();
  if (certificate_.steps.empty()) throw Refused("there are no steps");
  int events_in_order = -1;
  for (const auto& event : certificate_.events) {
    if (event.step < events_in_order + (&event == certificate_.events.data() ? 0 : 1))
      throw Refused("events are not in order, or two of them end the same step");
    events_in_order = event.step;
  }
  for (std::size_t k = 0; k < certificate_.steps.size(); ++k) {
    limit_.check();
    enter(certificate_.steps[k]);
    step_ = static_cast<int>(k);
    take(certificate_.steps[k]);
  }
  check_end();
}

/// The set that is stated contains the one that was found; it takes its place.
void CertificateChecker::enter(const CertifiedStep& stated) {
  std::vector<Ball> x = balls_of(stated.state, x_.size(), "x");
  const Ball t = ball_of_text(stated.time);
  if (!contains(t, t_)) throw Refused("the time of the next step does not contain the end of this one");
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!contains(x[i], x_[i]))
      throw Refused(fmt::format("x[{}] of the next step does not contain the result of this one", i));
  }
  require_modes(states_.modes, stated.modes);
  x_ = std::move(x);
  t_ = t;
}

/// (2): Picard's operator maps the set with the stated remainders into itself, see TaylorStep (1).
void CertificateChecker::require_remainders(const ModeMotion& motion, const CertifiedStep& stated) {
  const int n = scene_.n;
  const auto N = static_cast<ulong>(p_.precision().order);
  if (stated.remainders.size() != x_.size()) throw Refused("rho has not the size of x");
  p_.measure(motion.schedule, stated.length);
  mag_zero(p_.rho(scene_.clock));
  const auto variable = [&](int i) { return i < n ? scene_.q[i] : scene_.v[i - n]; };
  for (int i = 0; i < 2 * n; ++i) mag_set_d(p_.rho(variable(i)), stated.remainders[i]);
  for (const Node node : motion.schedule) {
    if (!p_.remainder(node)) throw Refused("the remainder of a formula is not bounded on the step");
  }
  for (int i = 0; i < 2 * n; ++i) {
    const Node rate = i < n ? scene_.v[i] : motion.acceleration[i - n];
    Magnitude length, mapped, rest;
    mag_set_d(length.get(), stated.length);
    if (!p_.is_constant(rate)) {
      mag_mul(mapped.get(), p_.size_of(rate, static_cast<int>(N)), length.get());
      mag_div_ui(mapped.get(), mapped.get(), N + 1);
    }
    mag_mul(rest.get(), p_.rho(rate), length.get());
    mag_div_ui(rest.get(), rest.get(), N + 2);
    mag_add(mapped.get(), mapped.get(), rest.get());
    if (mag_cmp(mapped.get(), p_.rho(variable(i))) > 0)
      throw Refused(fmt::format("Picard's operator maps the remainder of x[{}] to {:.3g}, above rho = {:.3g}", i,
                                mapped.upper(), stated.remainders[i]));
  }
}

int CertificateChecker::vanishing(const EventFunction& event) const {
  const int known = event.kind == EventKind::impact     ? states_.vanishing_gap[event.contact]
                    : event.kind == EventKind::slip_end ? states_.vanishing_slip[event.contact]
                                                        : 0;
  return p_.leading(event.node, known, p_.precision().order);
}

/// (5) and (6).
void CertificateChecker::require_no_event(const ModeMotion& motion, const CertifiedStep& stated, const Ball& end,
                                          const EventFunction* expected) {
  static const char* const kinds[] = {"the gap", "the normal force", "the slip velocity", "the distance to the cone"};
  const Precision& a = p_.precision();
  Ball last;
  arb_get_ubound_arf(arb_midref(last.get()), end.get(), a.bits);
  for (const auto& event : motion.events) {
    BoundedPolynomial f;
    taylor_.polynomial(f, event.node, stated.length, vanishing(event));
    const std::string name =
        fmt::format("{} of {}", kinds[static_cast<int>(event.kind)], scene_.contacts[event.contact].name);
    if (&event == expected) {
      if (!has_first_root(f, end, a)) throw Refused(name + " has not its first root at the stated time of the event");
    } else if (!stays_positive(f, Ball(), last, a)) {
      throw Refused(name + " does not stay positive on the step");
    }
  }
}

void CertificateChecker::take(const CertifiedStep& stated) {
  const Precision& a = p_.precision();
  const bool is_last = &stated == &certificate_.steps.back();
  const Ball h(stated.length), end = ball_of_text(stated.end), one(1.0);
  if (!(stated.length > 0) || end.sign() != Sign::positive || !arb_le(end.get(), one.get()))
    throw Refused("the end is not within the step");
  taylor_.load(x_, t_);
  require_bounds(scene_, states_.modes);
  if (modes_are_new_) motion_ = mode_motion(scene_, states_.modes, p_, {}, states_.left_out);
  taylor_.expand(motion_, a.order);
  require_remainders(motion_, stated);
  const CertificateEvent* event = event_at_end_of(step_);
  const EventFunction* function = event ? function_of(*event, motion_) : nullptr;
  require_no_event(motion_, stated, end, function);
  if (is_last) {
    if (event) throw Refused("an event at the end time");
    if (!contains(end, a.div(a.sub(scene_.end_time, t_), h)))
      throw Refused("the last step does not end at the end time");
  } else if (!event && !arb_is_exact(end.get())) {
    throw Refused("the end of the step has a radius, without an event");
  }
  std::vector<Ball> image;
  for (const auto* nodes : {&scene_.q, &scene_.v}) {
    for (const Node node : *nodes) image.push_back(taylor_.at(node, stated.length, end, a.bits));
  }
  x_ = std::move(image);
  t_ = a.add(t_, a.mul(end, h));
  states_.moved();
  modes_are_new_ = event != nullptr;
  if (!event) return;
  apply(*function, *event);
  require_modes(states_.modes, event->modes);
  require_number(event->time, ball_of_text(certificate_.steps[step_ + 1].time), "the time of the event");
}

void CertificateChecker::require_number(const CertifiedNumber& number, const Ball& ball,
                                        const std::string& what) const {
  const CertifiedNumber derived = stated_number(ball, certificate_.digits);
  if (derived.text != number.text || derived.radius != number.radius || derived.decimals != number.decimals)
    throw Refused(fmt::format("{} is {} +- {:g}, not {} +- {:g}", what, derived.text, derived.radius, number.text,
                              number.radius));
}

/// (7), the decimal numbers, and the grade.
void CertificateChecker::check_end() {
  const std::vector<Ball> end = balls_of(certificate_.final_state, x_.size(), "the final state");
  for (std::size_t i = 0; i < end.size(); ++i) {
    if (!contains(end[i], x_[i])) throw Refused(fmt::format("the final x[{}] does not contain the result", i));
  }
  require_modes(states_.modes, certificate_.final_modes);
  require_bounds(scene_, states_.modes);
  if (certificate_.events.size() && certificate_.events.back().step >= step_) throw Refused("an event after the end");
  const std::size_t n = scene_.n;
  if (certificate_.q.size() != n || certificate_.v.size() != n) throw Refused("q or v has the wrong size");
  for (std::size_t i = 0; i < n; ++i) {
    require_number(certificate_.q[i], end[i], fmt::format("q[{}]", i));
    require_number(certificate_.v[i], end[n + i], fmt::format("v[{}]", i));
  }
  for (const int i : decisions_.sticking_in_space()) {
    const std::string text = fmt::format("{} sticks; slip in space from rest is not refuted", scene_.contacts[i].name);
    if (std::ranges::count(assumptions_, text) == 0) assume(text);
  }
  const auto sorted = [](std::vector<std::string> list) {
    std::ranges::sort(list);
    return list;
  };
  if (sorted(assumptions_) != sorted(certificate_.assumptions))
    throw Refused(fmt::format("the assumptions are: {}", names(assumptions_)));
  const Grade grade = assumptions_.empty() ? Grade::proven : Grade::assumed;
  if (certificate_.grade != grade) throw Refused(fmt::format("the grade is {}", name_of(grade)));
}

CertificateReport check_certificate(const Certificate& certificate, bool with_hash, double max_seconds) {
  const TimeLimit limit(max_seconds);
  CertificateReport report;
  try {
    if (with_hash && certificate.hash != certificate.stated_hash)
      throw Refused("the content is not that of its hash: it was changed");
    CertificateChecker checker(certificate, limit);
    try {
      checker.run();
      report.is_valid = true;
    } catch (const std::exception& error) {
      report.step = checker.step();
      report.reason = error.what();
    }
  } catch (const std::exception& error) {
    report.reason = error.what();
  }
  report.seconds = limit.seconds();
  return report;
}

}  // namespace ricochet::reference::certified
