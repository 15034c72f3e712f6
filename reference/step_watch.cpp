#include "reference/step_watch.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"
#include "reference/bracketed_root.h"

namespace ricochet::reference {
namespace {

constexpr int kMostPieces = 400;
constexpr int kDeepest = 20;                // halvings of a step
constexpr int kSampleDepth = 4;             // halvings where nothing but values is known
constexpr double kNearZero = 4;             // changes over a step that a force without time is to be away from zero
constexpr double kTermRounding = 1e-14;     // rounding of a polynomial's terms
constexpr double kUnexplained = 1e-3;       // part of a force by which its bounds may exceed its values
constexpr int kTimes = 5;                   // within a span, at which a force is compared with its bounds
constexpr double kRoundingOfZero = 1e-280;  // above the width that interval.h gives to a zero
constexpr double kNegligible = 1e-12;       // of the largest force
constexpr int kFinest = 24;                 // halvings of the time that is looked at ahead
constexpr std::size_t kMostSpans = 100000;  // of a run; later ones are not halved
constexpr double kSpansPerStep = 2;         // spans of the time that a step may be long

}  // namespace

StepWatch::StepWatch(const Problem& problem, const Scales& scales, double tolerance, ContactDynamics& dynamics,
                     const Slips& slips, const Flights& flights, SmoothMotion& motion)
    : problem_(problem),
      scales_(scales),
      tolerance_(tolerance),
      dynamics_(dynamics),
      slips_(slips),
      flights_(flights),
      motion_(motion),
      force_bounds_(problem),
      packed_n_(problem.info().n_normal_entries),
      packed_t_(problem.info().n_tangent_entries),
      start_(motion.n_roots()),
      stop_(motion.n_roots()),
      gaps_(problem.n_c()),
      middle_(2 * problem.n_q()),
      y_(2 * problem.n_q()),
      zero_(Vector::Zero(problem.n_q())) {
  const auto& info = problem.info();
  box_.resize(static_cast<std::size_t>(2 * info.n_q));
  rate_box_.resize(static_cast<std::size_t>(info.n_q));
  gap_box_.resize(info.contacts.size());
  normal_.resize(static_cast<std::size_t>(info.n_normal_entries));
  tangent_.resize(static_cast<std::size_t>(info.n_tangent_entries));
}

/// (1) about the end of the step.
void StepWatch::set_polynomials() {
  Integrator& integrator = motion_.integrator();
  degree_ = integrator.degree();
  const Eigen::Index n = 2 * problem_.n_q();
  coefficients_.resize(degree_ + 1, n);
  double factorial = 1;
  for (int j = 0; j <= degree_; ++j) {
    factorial *= std::max(j, 1);
    const double* y = integrator.derivative(end_, j);
    for (Eigen::Index k = 0; k < n; ++k) coefficients_(j, k) = y[k] / factorial;
  }
  shifted_.resize(degree_ + 1, n);
  power_.resize(degree_ + 1);
}

bool StepWatch::has_constant_forces() const {
  const auto& structure = problem_.info().structure;
  return structure.constant_mass && !structure.force_uses_position && !structure.force_uses_velocity &&
         std::ranges::all_of(dynamics_.closed(), [&](int i) {
           return problem_.info().contacts[i].is_affine && dynamics_.modes()[i] != ContactMode::slip;
         });
}

void StepWatch::list_functions() {
  const auto& info = problem_.info();
  const double part = std::max(kSame, 100 * tolerance_);  // as for roots that were missed
  const bool has_forces = !has_constant_forces();
  const auto stop = coefficients_.row(0);
  problem_.normal_jacobian(y_.data(), packed_n_.data());
  if (!dynamics_.closed().empty() && info.has_friction()) problem_.tangent_jacobian(y_.data(), packed_t_.data());
  const auto size = [&](const ContactInfo& contact, const double* J, Eigen::Index first, const Vector& scale) {
    double sum = 0;
    for (const int k : contact.support) sum += std::abs(*J++) * (std::abs(stop[first + k]) + scale[k]);
    return sum;
  };
  force_bounds_.set_modes(dynamics_.modes());
  functions_.clear();
  const auto add = [&](const Function& f) {
    const bool is_force = f.kind == Kind::force || f.kind == Kind::cone;
    if (is_force) {
      if (!has_forces) return;
      const double low = std::min(start_[f.index], stop_[f.index]), change = std::abs(stop_[f.index] - start_[f.index]);
      if (info.clock < 0 && !motion_.integrator().takes_long_steps() && low > kNearZero * change &&
          low > part * motion_.force_size(f.contact))
        return;
    }
    functions_.push_back(f);
  };
  for (auto* list : {&curved_open_, &curved_closed_}) list->clear();
  for (const int i : info.unilateral) {
    const auto& contact = info.contacts[i];
    const ContactMode mode = dynamics_.modes()[i];
    if (!contact.is_affine) (is_closed(mode) ? curved_closed_ : curved_open_).push_back(i);
    if (!is_closed(mode)) {
      const double slack = tolerance_ * size(contact, packed_n_.data() + contact.normal_begin, 0, scales_.position());
      add({Kind::gap, i, i, slack, 0});
      continue;
    }
    const auto slack_of = [&](int index) {
      const double there = std::max(std::abs(start_[index]), std::abs(stop_[index]));
      return std::max(kSame * motion_.force_size(i), part * std::min(motion_.force_size(i), there));
    };
    add({Kind::force, i, i, slack_of(i), 0});
    if (contact.n_t == 0) continue;
    const int index = motion_.friction_root(i);
    if (mode == ContactMode::slip && slips_.is_new(i)) force_bounds_.hold_direction(i, slips_.direction(i).data());
    if (mode == ContactMode::stick) {
      add({Kind::cone, i, index, slack_of(index), 0});
    } else {
      double largest = 0;
      for (int k = 0; k < contact.n_t; ++k) {
        const double* J = packed_t_.data() + contact.tangent_begin + k * std::ssize(contact.support);
        largest = std::max(largest, size(contact, J, problem_.n_q(), scales_.velocity()));
      }
      add({Kind::slip, i, index, part * largest, slips_.root(i, packed_t_.data(), zero_.data())});
    }
  }
}

void StepWatch::values_at(double s, Vector& values) {
  y_ = coefficients_.row(degree_);
  for (int j = degree_ - 1; j >= 0; --j) y_ = s * y_ + coefficients_.row(j).transpose();
  values.resize(motion_.n_roots());
  if (!motion_.roots(y_.data(), values.data())) values.setConstant(NAN);
}

std::optional<double> StepWatch::first_root(double from, double to, Roots& found) {
  if (problem_.n_c() == 0 || !(to > from)) return std::nullopt;
  end_ = to;
  length_ = to - from;
  set_polynomials();
  if (!has_start_) values_at(-length_, start_);
  values_at(0, stop_);
  list_functions();
  has_start_ = true;
  std::optional<double> root;
  if (!functions_.empty()) {
    Functions all;
    for (const Function& f : functions_) all.push_back(&f);
    int budget = kMostPieces;
    const Function* first = nullptr;
    root = search({-length_, 0, 0, start_, stop_}, all, budget, first);
    if (root) {
      found = motion_.no_roots();
      (first->kind == Kind::gap || first->kind == Kind::force ? found.normal : found.friction)[first->contact] = true;
    }
  }
  start_.swap(stop_);
  return root;
}

/// (1) about the middle of the piece, by Horner's scheme.
void StepWatch::set_piece(const Piece& piece) {
  radius_ = 0.5 * (piece.to - piece.from);
  const double middle = 0.5 * (piece.from + piece.to);
  shifted_ = coefficients_;
  for (Eigen::Index k = 0; k < shifted_.cols(); ++k) {
    double* x = shifted_.col(k).data();
    for (int i = 0; i < degree_; ++i) {
      for (int j = degree_ - 1; j >= i; --j) x[j] += middle * x[j + 1];
    }
  }
  middle_ = shifted_.row(0);
  power_[0] = 1;
  for (int j = 1; j <= degree_; ++j) power_[j] = power_[j - 1] * radius_;
  problem_.gap(middle_.data(), gaps_.data());
  has_boxes_ = has_forces_ = has_slips_ = false;
}

/// (2)
void StepWatch::set_boxes() {
  has_boxes_ = true;
  for (Eigen::Index k = 0; k < shifted_.cols(); ++k) {
    double way = 0, rate_way = 0;
    for (int j = 1; j <= degree_; ++j) {
      way += std::abs(shifted_(j, k)) * power_[j];
      if (j > 1) rate_way += j * std::abs(shifted_(j, k)) * power_[j - 1];
    }
    way += kTermRounding * (std::abs(middle_[k]) + way);
    box_[k] = {middle_[k] - way, middle_[k] + way};
    if (k >= problem_.n_q()) continue;
    const double rate = degree_ > 0 ? shifted_(1, k) : 0;
    rate_way += kTermRounding * (std::abs(rate) + rate_way);
    rate_box_[k] = {rate - rate_way, rate + rate_way};
  }
  if (!problem_.info().structure.has_bounds) return;
  if (curved_open_.empty()) return;
  problem_.gap_bounds(curved_open_, box_.data(), gap_box_.data());
  problem_.normal_bounds(curved_open_, box_.data(), normal_.data());
}

/// x_j += factor J' x_j, of q or of v.
void StepWatch::add_polynomial(const ContactInfo& contact, const double* J, double factor, bool of_velocity,
                               double* x) const {
  const Eigen::Index first = of_velocity ? problem_.n_q() : 0;
  for (const int k : contact.support) {
    const double entry = factor * *J++;
    for (int j = 0; j <= degree_; ++j) x[j] += entry * shifted_(j, first + k);
  }
}

void StepWatch::bounds_of(const Function& function, Interval& value, Interval& rate) {
  const int i = function.contact;
  const auto& contact = problem_.info().contacts[i];
  const bool has_bounds = problem_.info().structure.has_bounds;
  value = rate = Interval::whole();
  const auto of_polynomial = [&](const double* x, double middle) {  // (3)
    double way = 0, rate_way = 0;
    for (int j = 1; j <= degree_; ++j) {
      way += std::abs(x[j]) * power_[j];
      if (j > 1) rate_way += j * std::abs(x[j]) * power_[j - 1];
    }
    value = {middle - way, middle + way};
    if (degree_ > 0) rate = {x[1] - rate_way, x[1] + rate_way};
  };
  double x[16] = {};
  switch (function.kind) {
    case Kind::gap: {
      const double middle = gaps_[i] + flights_.offset()[i];
      if (contact.is_affine) {
        add_polynomial(contact, packed_n_.data() + contact.normal_begin, 1, false, x);
        of_polynomial(x, middle);
      } else if (has_bounds) {  // (4)
        if (!has_boxes_) set_boxes();
        rate = 0.0;
        for (std::size_t s = 0; s < contact.support.size(); ++s)
          rate += normal_[contact.normal_begin + s] * rate_box_[contact.support[s]];
        const double way = radius_ * rate.magnitude();
        value = gap_box_[i] + Interval(flights_.offset()[i]);
        value = {std::max(value.lower, middle - way), std::min(value.upper, middle + way)};
      }
      return;
    }
    case Kind::slip: {
      const auto n = std::ssize(contact.support);
      const Vector& d = slips_.direction(i);
      if (contact.is_affine) {
        for (int k = 0; k < contact.n_t; ++k)
          add_polynomial(contact, packed_t_.data() + contact.tangent_begin + k * n, d[k], true, x);
        of_polynomial(x, x[0] + function.offset);
      } else if (has_bounds) {  // (5)
        if (!has_boxes_) set_boxes();
        if (!has_slips_) problem_.tangent_bounds(curved_closed_, box_.data(), tangent_.data());
        has_slips_ = true;
        value = function.offset;
        for (int k = 0; k < contact.n_t; ++k) {
          Interval sum = 0.0;
          for (std::ptrdiff_t s = 0; s < n; ++s)
            sum += tangent_[contact.tangent_begin + k * n + s] * box_[problem_.n_q() + contact.support[s]];
          value += Interval(d[k]) * sum;
        }
      }
      return;
    }
    default: {  // (6)
      if (!has_bounds) return;
      if (!has_boxes_) set_boxes();
      if (!has_forces_) {
        forces_known_ = force_bounds_.evaluate(box_.data(), box_.data() + problem_.n_q(), middle_.data(),
                                               middle_.data() + problem_.n_q());
      }
      has_forces_ = true;
      if (!forces_known_) return;
      value = function.kind == Kind::force ? force_bounds_.normal_force(i) : force_bounds_.cone_margin(i);
    }
  }
}

std::optional<double> StepWatch::search(const Piece& piece, const Functions& functions, int& budget,
                                        const Function*& first) {
  --budget;
  set_piece(piece);
  const bool is_last = piece.depth >= kDeepest || (budget <= 0 && piece.depth >= kSampleDepth);
  Functions open, located;
  for (const Function* f : functions) {
    Interval value, rate;
    bounds_of(*f, value, rate);
    if (value.lower > -f->slack) continue;
    const bool falls = piece.left[f->index] >= -f->slack && piece.right[f->index] < -f->slack;
    const bool is_unknown = !std::isfinite(value.lower) && piece.depth > kSampleDepth;
    if (rate.lower >= 0 || rate.upper <= 0 || is_last || is_unknown) {
      if (falls) located.push_back(f);
    } else {
      open.push_back(f);
    }
  }
  if (open.empty()) return first_of(located, piece, first);
  open.insert(open.end(), located.begin(), located.end());
  const double middle = 0.5 * (piece.from + piece.to);
  Vector values;
  values_at(middle, values);
  if (const auto t = search({piece.from, middle, piece.depth + 1, piece.left, values}, open, budget, first)) return t;
  return search({middle, piece.to, piece.depth + 1, values, piece.right}, open, budget, first);
}

std::optional<double> StepWatch::first_of(const Functions& located, const Piece& piece, const Function*& first) {
  std::optional<double> earliest;
  for (const Function* f : located) {
    // A growing gap at the level of rounding or integration errors does not close.
    if (f->kind == Kind::gap && !(piece.left[f->index] > 0)) continue;
    const double t = locate(*f, piece);
    if (earliest && *earliest <= t) continue;
    earliest = t;
    first = f;
  }
  return earliest;
}

double StepWatch::locate(const Function& function, const Piece& piece) {
  const double shift = piece.left[function.index] > 0 ? 0 : function.slack;
  Vector values;
  const auto value = [&](double t) {
    values_at(t - end_, values);
    return values[function.index] + shift;
  };
  return bracketed_root(value, end_ + piece.from, end_ + piece.to);
}

/// Time spans up to `until` within which a force at (q, v) lies between its values at five times, approximately, and
/// these values lie near a parabola. If one of them meets a pulse, the third differences are as large as the pulse.
void StepWatch::look_ahead(double until, const Vector& q, const Vector& v) {
  const auto& info = problem_.info();
  const double T = info.end_time;
  const Eigen::Index n = info.n_q;
  std::vector<Interval> at(q.data(), q.data() + n), moving(v.data(), v.data() + n), bounds(static_cast<std::size_t>(n));
  Vector place = q, f(n);
  Matrix values(n, kTimes);
  if (negligible_.size() == 0) {
    at[info.clock] = {info.start_time(), info.start_time() + T};
    problem_.force_bounds(at.data(), moving.data(), info.u.data(), bounds.data());
    negligible_.setConstant(n, kRoundingOfZero);
    for (Eigen::Index k = 0; k < n; ++k) {
      if (std::isfinite(bounds[k].magnitude())) negligible_[k] += kNegligible * bounds[k].magnitude();
    }
  }
  while (ahead_ < until) {
    double length = std::min(T / 16, T - ahead_);
    for (int halvings = 0;; ++halvings, length /= 2) {
      at[info.clock] = {info.start_time() + ahead_, info.start_time() + ahead_ + length};
      problem_.force_bounds(at.data(), moving.data(), info.u.data(), bounds.data());
      for (int k = 0; k < kTimes; ++k) {
        place[info.clock] = info.start_time() + ahead_ + k * length / (kTimes - 1);
        problem_.force(place.data(), v.data(), info.u.data(), f.data());
        values.col(k) = f;
      }
      bool is_explained = true;
      for (Eigen::Index k = 0; k < n && is_explained; ++k) {
        const auto x = values.row(k);
        const double low = x.minCoeff(), high = x.maxCoeff(), size = x.cwiseAbs().maxCoeff();
        const double more = std::max({0.5 * (high - low), kUnexplained * size, negligible_[k]});
        const double bends =
            std::max(std::abs(x[3] - 3 * x[2] + 3 * x[1] - x[0]), std::abs(x[4] - 3 * x[3] + 3 * x[2] - x[1]));
        is_explained = bounds[k].upper <= high + more && bounds[k].lower >= low - more && bends <= 0.5 * more;
      }
      const bool is_number = values.allFinite();  // where it is none, the integrator ends
      if (is_explained || !is_number || halvings == kFinest || spans_.size() > kMostSpans) break;
    }
    const double end = ahead_ + length;
    if (!(end > ahead_)) return;
    spans_.push_back({ahead_, T - end < 1e-12 * T ? T : end});
    ahead_ = spans_.back().to;
  }
}

double StepWatch::longest_step(double t, double planned, const Vector& q, const Vector& v) {
  const auto& info = problem_.info();
  const double T = info.end_time;
  if (!info.structure.has_bounds) {
    const Vector gap = problem_.gap(q), rate = problem_.normal_jacobian(q).transpose() * v;
    double longest = T;
    for (const int i : info.unilateral) {
      if (!is_closed(dynamics_.modes()[i]) && rate[i] != 0) longest = std::min(longest, std::abs(gap[i] / rate[i]));
    }
    return std::max(longest, 1e-3 * T);
  }
  if (info.clock < 0 || !info.structure.force_uses_position) return 0;
  const double window = std::min(T - t, std::max(10 * planned, T / 64));
  look_ahead(t + window, q, v);
  while (passed_ < spans_.size() && spans_[passed_].to <= t) ++passed_;
  double longest = window;
  for (std::size_t k = passed_; k < spans_.size() && spans_[k].from < t + longest; ++k)
    longest = std::min(longest, std::max(spans_[k].from - t, kSpansPerStep * (spans_[k].to - spans_[k].from)));
  return longest;
}

}  // namespace ricochet::reference
