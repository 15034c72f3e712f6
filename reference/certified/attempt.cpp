#include "reference/certified/attempt.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <memory>

#include "reference/certified/motion_by_regions.h"

namespace ricochet::reference::certified {
namespace {

constexpr double kBitsPerDigit = 3.3219280948873626;
constexpr int kSpareBits = 60;  // of the first attempt, lost along the motion
constexpr int kMostAttempts = 12;
constexpr int kMostBitsFactor = 8;  // of the first attempt: what is undecided then is taken for a tie
constexpr double kLost = -4;        // log10 of the radius of a state that is lost, for want of bits
constexpr double kRoomOfCut = 3;    // digits per decimal place of a cut, because gaps are like squares of velocities
constexpr double kTieLoss = 30;     // digits; what is undecided twice with less is taken for a tie
constexpr int kLeastOrder = 12;
constexpr double kShareOfSensitivities = 0.7;  // of the wall time that is left

/// Digits that boxes may lose before the mean value form is cheaper, which costs (2n)^2 more series.
double affordable_loss(int n) {
  return 20 + 10 * n;
}

/// Digits that boxes have `lost` in an attempt, or lose until the end time if it stopped because they became wide.
double expected_loss(const CertifiedMotion& motion, double lost, bool is_undecided, double end_time) {
  constexpr double kWide = 0.5;  // of all digits: what is undecided with less is no matter of width
  const bool is_wide = lost > kWide * static_cast<double>(motion.bits) / kBitsPerDigit;
  if (!is_undecided || !is_wide) return lost;
  const double part = std::strtod(motion.end_time.text.c_str(), nullptr) / end_time;
  return lost / std::clamp(part, 0.01, 1.0);
}

}  // namespace

Attempt attempt(const Problem& problem, const Options& options, const TimeLimit& limit, int cut) {
  Attempt result;
  const int order = std::max(kLeastOrder, static_cast<int>(options.order_per_bit * static_cast<double>(options.bits)));
  const Precision precision{static_cast<slong>(options.bits), order};
  const auto stop = [&](const std::string& reason) {
    result.motion.grade = Grade::open;
    result.motion.reason = reason;
    result.motion.bits = options.bits;
    result.motion.order = order;
    result.motion.q.clear();
    result.motion.v.clear();
    result.motion.modes.clear();
    result.motion.sensitivities.clear();
  };
  try {
    std::unique_ptr<Sensitivities> sensitivities;
    const bool has_regions = !problem.info().switches.empty();
    if (options.with_sensitivities && cut == 0 && !has_regions) {
      const double left = options.max_seconds - limit.seconds();
      sensitivities =
          std::make_unique<Sensitivities>(problem, options.reading, precision, kShareOfSensitivities * left);
    }
    MotionByRegions motion(problem, options, precision, limit, cut);
    if (sensitivities) motion.follow(*sensitivities);
    const auto take = [&] {
      if (!motion.motion()) return;
      result.motion = motion.motion()->result();
      if (has_regions && options.with_sensitivities) result.motion.no_sensitivities = "a formula bends or jumps";
      result.log10_radius = motion.motion()->log10_radius();
    };
    const auto end = [&](const std::string& reason) {
      take();
      if (motion.motion()) result.accumulates = motion.motion()->impacts_accumulate();
      stop(reason);
    };
    try {
      motion.run();
      take();
    } catch (const Undecided& error) {
      result.is_undecided = true;
      end(error.what());
    } catch (const OutOfTime& error) {
      result.is_out_of_time = true;
      end(error.what());
    } catch (const Unsupported& error) {
      end(error.what());
    }
  } catch (const Bends& error) {
    stop(error.what());
    result.motion.bends = true;
  } catch (const std::exception& error) {  // no formulas, or formulas without a value, such as 1/0
    stop(error.what());
  }
  return result;
}

Attempt attempts(const Problem& problem, Options next, const TimeLimit& limit, int cut) {
  if (next.bits <= 0)
    next.bits = std::lround(std::max<double>(next.digits, kRoomOfCut * cut) * kBitsPerDigit) + kSpareBits;
  const long most_bits = kMostBitsFactor * next.bits;
  const double wanted = -static_cast<double>(next.digits);
  Attempt last;
  std::string reason;
  for (int n = 1; n <= kMostAttempts; ++n) {
    last = attempt(problem, next, limit, cut);
    last.motion.attempts = n;
    const bool is_final = last.motion.grade == Grade::open ? !last.is_undecided : last.log10_radius <= wanted;
    if (is_final) break;
    const double lost = last.log10_radius + static_cast<double>(next.bits) / kBitsPerDigit;  // digits
    const bool is_same = last.is_undecided && last.motion.reason == reason;
    const bool needs_bits = last.accumulates;              // to reach the cut, or speeds that the digits do not notice
    if (is_same && lost < kTieLoss && !needs_bits) break;  // a tie
    reason = last.motion.reason;
    // After each event the form begins again with a box; a certificate has boxes only.
    const bool has_long_flights = last.motion.n_steps > 2 * std::ssize(last.motion.events) && !next.with_steps;
    const double loss = expected_loss(last.motion, lost, last.is_undecided, problem.info().end_time);
    if (!next.mean_value_form && has_long_flights && loss > affordable_loss(problem.n_q())) {
      next.mean_value_form = true;
      next.bits += kSpareBits / 2;  // for the condition of the motion: cheaper than a second run
    } else if (last.is_undecided) {
      next.bits = 2 * next.bits;
    } else {
      next.bits += std::lround((last.log10_radius - wanted) * kBitsPerDigit) + 12;
    }
    if (next.bits > most_bits && last.log10_radius < kLost) break;
  }
  if (last.is_out_of_time && !reason.empty()) last.motion.reason += ", before it: " + reason;
  return last;
}

}  // namespace ricochet::reference::certified
