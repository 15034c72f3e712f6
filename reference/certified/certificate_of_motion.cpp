#include <flint/flint.h>
#include <fmt/format.h>

#include "problems/input_error.h"
#include "problems/scene_file/scene_writer.h"
#include "reference/certified/certificate_checker.h"
#include "reference/certified/sha256.h"

namespace ricochet::reference::certified {
namespace {

/// Impacts at one time end the same step. Impacts that accumulate are not verified one by one.
void require_single_events(const std::vector<CertificateEvent>& events) {
  for (const auto& event : events) {
    if (event.kind == "zeno_end")
      throw InputError(
          fmt::format("no certificate: impacts of {} accumulate at t = {}", event.contact, event.time.text));
  }
  for (std::size_t k = 1; k < events.size(); ++k) {
    if (events[k].step == events[k - 1].step)
      throw InputError(fmt::format("no certificate: simultaneous impacts of {} and {} at t = {}", events[k - 1].contact,
                                   events[k].contact, events[k].time.text));
  }
}

/// An event with the step that it ends.
CertificateEvent event_of(const CertifiedEvent& event, int index, const CertifiedMotion& motion, int digits) {
  CertificateEvent stated{-1, event.kind, event.contact, event.modes, {}, event.Lambda_n};
  while (stated.step + 1 < std::ssize(motion.steps) && motion.steps[stated.step + 1].n_events <= index) ++stated.step;
  const bool is_at_start = stated.step < 0;
  stated.time = stated_number(is_at_start ? Ball() : ball_of_text(motion.steps[stated.step + 1].time), digits);
  return stated;
}

}  // namespace

Certificate certificate_of(const Problem& problem, const CertifiedMotion& motion, const Options& options) {
  if (motion.grade == Grade::open) throw InputError("no certificate: " + motion.reason);
  if (!motion.no_certificate.empty()) throw InputError("no certificate: " + motion.no_certificate);
  if (motion.mean_value_form) throw InputError("no certificate: the motion was enclosed in mean value form");
  if (motion.steps.empty()) throw InputError("no certificate: the steps were not recorded");
  Certificate c;
  c.scene = scene_text(problem);
  c.scene_hash = sha256(c.scene);
  c.reading = motion.reading;
  c.digits = options.digits;
  c.bits = motion.bits;
  c.order = motion.order;
  c.grade = motion.grade;
  c.assumptions = motion.assumptions;
  c.steps = motion.steps;
  for (std::size_t k = 0; k < motion.events.size(); ++k)
    c.events.push_back(event_of(motion.events[k], static_cast<int>(k), motion, options.digits));
  require_single_events(c.events);
  c.final_state = motion.final_state;
  c.final_modes = motion.modes;
  for (std::size_t i = 0; i < c.final_state.size(); ++i)
    (2 * i < c.final_state.size() ? c.q : c.v).push_back(stated_number(ball_of_text(c.final_state[i]), options.digits));
  c.versions = {{"arb", arb_version}, {"flint", FLINT_VERSION}};
  return c;
}

}  // namespace ricochet::reference::certified
