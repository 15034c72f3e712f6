#include "methods/islands/joined_parts.h"

#include <algorithm>

#include "problems/run_pieces.h"

namespace ricochet {
namespace {

/// Copies entries of a part to where they are in the whole.
void scatter(const std::vector<int>& numbers, const Vector& part, Vector& whole) {
  for (std::size_t k = 0; k < numbers.size(); ++k) whole[numbers[k]] = part[static_cast<Eigen::Index>(k)];
}

void scatter(const std::vector<int>& numbers, const std::vector<ContactMode>& part, std::vector<ContactMode>& whole) {
  for (std::size_t k = 0; k < part.size(); ++k) whole[static_cast<std::size_t>(numbers[k])] = part[k];
}

class Join {
 public:
  Join(const ProblemInfo& info, const std::vector<PartSolution>& parts, double length)
      : info_(info), parts_(parts), length_(length) {
    whole_.t = length;
    whole_.q.resize(info.n_q);
    whole_.v.resize(info.n_q);
    whole_.initial_modes.assign(info.contacts.size(), ContactMode::open);
    for (const auto& [members, solution] : parts) {
      scatter(members.contacts, solution.initial_modes, whole_.initial_modes);
      scatter(members.coordinates, solution.q, whole_.q);
      scatter(members.coordinates, solution.v, whole_.v);
      add_groups(members, solution);
      std::vector<Residual> residuals = solution.residuals;
      for (Residual& residual : residuals) {
        if (residual.contact >= 0) residual.contact = members.contacts[static_cast<std::size_t>(residual.contact)];
      }
      add_residuals(residuals, 0, whole_.residuals);
    }
    std::ranges::stable_sort(whole_.captures, {}, &CapturedGroup::t);
    std::ranges::stable_sort(whole_.wedges, {}, &OpenWedge::t);
  }

  Solution finish(Recording recording) {
    if (recording >= Recording::events)
      add_events();
    else
      add_events_at_start();
    if (recording >= Recording::grid) add_samples();
    if (recording == Recording::motion) add_motion();
    return std::move(whole_);
  }

 private:
  void add_groups(const WindowPlan::Part& members, const Solution& solution);
  void add_events();
  void add_events_at_start();
  void add_samples();
  void add_motion();
  void set_state(double t, Vector& q, Vector& v) const;

  const ProblemInfo& info_;
  const std::vector<PartSolution>& parts_;
  const double length_;
  Solution whole_;
};

void Join::add_groups(const WindowPlan::Part& members, const Solution& solution) {
  whole_.captures.insert(whole_.captures.end(), solution.captures.begin(), solution.captures.end());
  for (OpenWedge wedge : solution.wedges) {
    for (int& i : wedge.contacts) i = members.contacts[static_cast<std::size_t>(i)];
    whole_.wedges.push_back(std::move(wedge));
  }
}

/// The state of all parts after time t [s].
void Join::set_state(double t, Vector& q, Vector& v) const {
  Vector q_part, v_part;
  for (const auto& [members, solution] : parts_) {
    const Motion& motion = solution.motion;
    if (motion.empty() || t >= motion.end()) {
      q_part = solution.q;
      v_part = solution.v;
    } else {
      motion.at(std::max(t, motion.begin()), q_part, v_part);
    }
    scatter(members.coordinates, q_part, q);
    scatter(members.coordinates, v_part, v);
  }
}

void Join::add_events() {
  struct Place {
    double t;
    std::size_t part, number;
  };
  std::vector<Place> order;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Solution& solution = parts_[p].solution;
    for (std::size_t k = 0; k < solution.events.size(); ++k) order.push_back({solution.events[k].t, p, k});
  }
  std::ranges::stable_sort(order, {}, &Place::t);
  std::vector<ContactMode> modes = whole_.initial_modes;
  for (const Place& place : order) {
    const auto& [members, solution] = parts_[place.part];
    const Event& of_part = solution.events[place.number];
    scatter(members.contacts, of_part.modes, modes);
    Event event{.t = of_part.t,
                .kind = of_part.kind,
                .contact = members.contacts[static_cast<std::size_t>(of_part.contact)],
                .q = Vector(info_.n_q),
                .v_minus = Vector(info_.n_q),
                .v_plus = {},
                .Lambda_n = Vector::Zero(info_.n_c()),
                .Lambda_t = Vector::Zero(info_.n_lambda_t),
                .modes = modes,
                .dt = {}};
    set_state(of_part.t, event.q, event.v_minus);
    event.v_plus = event.v_minus;
    scatter(members.coordinates, of_part.q, event.q);
    scatter(members.coordinates, of_part.v_minus, event.v_minus);
    scatter(members.coordinates, of_part.v_plus, event.v_plus);
    scatter(members.contacts, of_part.Lambda_n, event.Lambda_n);
    Eigen::Index from = 0;
    for (const int i : members.contacts) {
      const auto& contact = info_.contacts[static_cast<std::size_t>(i)];
      event.Lambda_t.segment(contact.tangent_index, contact.n_t) = of_part.Lambda_t.segment(from, contact.n_t);
      from += contact.n_t;
    }
    whole_.events.push_back(std::move(event));
  }
}

/// So that append() counts no change of a mode at the start twice.
void Join::add_events_at_start() {
  for (const auto& [members, solution] : parts_) {
    for (const Event& event : solution.events) {
      if (event.t > 0) break;
      whole_.events.push_back({.t = 0, .contact = members.contacts[static_cast<std::size_t>(event.contact)]});
    }
  }
}

void Join::add_samples() {
  struct Place {
    double t;
    std::size_t part, number;
  };
  std::vector<Place> order;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const auto& samples = parts_[p].solution.samples;
    for (std::size_t k = 0; k < samples.size(); ++k) order.push_back({samples[k].t, p, k});
  }
  std::ranges::stable_sort(order, {}, &Place::t);
  for (const Place& place : order) {
    const auto& [members, solution] = parts_[place.part];
    const Sample& of_part = solution.samples[place.number];
    const bool has_impact = of_part.v_minus != of_part.v_plus;
    if (!has_impact && !whole_.samples.empty() && whole_.samples.back().t == place.t) continue;
    Sample sample{.t = place.t, .q = Vector(info_.n_q), .v_minus = Vector(info_.n_q), .v_plus = {}};
    set_state(place.t, sample.q, sample.v_minus);
    sample.v_plus = sample.v_minus;
    scatter(members.coordinates, of_part.q, sample.q);
    scatter(members.coordinates, of_part.v_minus, sample.v_minus);
    scatter(members.coordinates, of_part.v_plus, sample.v_plus);
    whole_.samples.push_back(std::move(sample));
  }
}

void Join::add_motion() {
  std::vector<double> times{0, length_};
  for (const auto& part : parts_) {
    const Motion& motion = part.solution.motion;
    for (std::size_t piece = 0; piece < motion.n_pieces(); ++piece) times.push_back(motion.begin_of(piece));
  }
  std::ranges::sort(times);
  times.erase(std::ranges::unique(times).begin(), times.end());
  std::vector<std::size_t> at(parts_.size(), 0);  // piece of each part
  Vector q_part, v_part;
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    const double begin = times[k], end = times[k + 1], middle = 0.5 * (begin + end);
    int degree = 1;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      const Motion& motion = parts_[p].solution.motion;
      if (motion.empty()) continue;
      while (at[p] + 1 < motion.n_pieces() && motion.end_of(at[p]) <= middle) ++at[p];
      degree = std::max(degree, motion.degree_of(at[p]));
    }
    whole_.motion.add(begin, end, degree, [&](double s, Vector& q, Vector& v) {
      q.resize(info_.n_q);
      v.resize(info_.n_q);
      for (std::size_t p = 0; p < parts_.size(); ++p) {
        const auto& [members, solution] = parts_[p];
        const Motion& motion = solution.motion;
        const double from = motion.begin_of(at[p]), to = motion.end_of(at[p]);
        motion.within(at[p], std::clamp((begin + s * (end - begin) - from) / (to - from), 0.0, 1.0), q_part, v_part);
        scatter(members.coordinates, q_part, q);
        scatter(members.coordinates, v_part, v);
      }
    });
  }
}

}  // namespace

std::vector<ContactMode> joined_modes(const ProblemInfo& info, const std::vector<PartSolution>& parts) {
  std::vector<ContactMode> modes(info.contacts.size(), ContactMode::open);
  for (const auto& [members, solution] : parts)
    scatter(members.contacts, solution.events.empty() ? solution.initial_modes : solution.events.back().modes, modes);
  return modes;
}

Solution joined(const ProblemInfo& info, const std::vector<PartSolution>& parts, double length, Recording recording) {
  return Join(info, parts, length).finish(recording);
}

}  // namespace ricochet
