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
  struct Place {
    std::size_t part, number;
  };
  template <class Entry>
  std::vector<Place> in_order_of_time(std::vector<Entry> Solution::*list) const;
  template <class Entry>
  void set_state(const WindowPlan::Part& own, const Entry& of_part, Entry& entry) const;

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

/// All entries of a list of the parts, by part and number, in the order of time.
template <class Entry>
std::vector<Join::Place> Join::in_order_of_time(std::vector<Entry> Solution::*list) const {
  std::vector<Place> order;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    for (std::size_t k = 0; k < (parts_[p].solution.*list).size(); ++k) order.push_back({p, k});
  }
  std::ranges::stable_sort(order, {}, [&](const Place& at) { return (parts_[at.part].solution.*list)[at.number].t; });
  return order;
}

/// Sets the state of an event or a sample to that of its part, and to that of the others after its time.
template <class Entry>
void Join::set_state(const WindowPlan::Part& own, const Entry& of_part, Entry& entry) const {
  entry.q.resize(info_.n_q);
  entry.v_minus.resize(info_.n_q);
  Vector q, v;
  for (const auto& [members, solution] : parts_) {
    const Motion& motion = solution.motion;
    if (motion.empty() || of_part.t >= motion.end()) {
      q = solution.q;
      v = solution.v;
    } else {
      motion.at(std::max(of_part.t, motion.begin()), q, v);
    }
    scatter(members.coordinates, q, entry.q);
    scatter(members.coordinates, v, entry.v_minus);
  }
  entry.v_plus = entry.v_minus;
  scatter(own.coordinates, of_part.q, entry.q);
  scatter(own.coordinates, of_part.v_minus, entry.v_minus);
  scatter(own.coordinates, of_part.v_plus, entry.v_plus);
}

void Join::add_events() {
  std::vector<ContactMode> modes = whole_.initial_modes;
  for (const auto& [part, number] : in_order_of_time(&Solution::events)) {
    const auto& [members, solution] = parts_[part];
    const Event& of_part = solution.events[number];
    scatter(members.contacts, of_part.modes, modes);
    Event event{.t = of_part.t,
                .kind = of_part.kind,
                .contact = members.contacts[static_cast<std::size_t>(of_part.contact)],
                .q = {},
                .v_minus = {},
                .v_plus = {},
                .Lambda_n = Vector::Zero(info_.n_c()),
                .Lambda_t = Vector::Zero(info_.n_lambda_t),
                .modes = modes,
                .dt = {}};
    set_state(members, of_part, event);
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
  for (const auto& [part, number] : in_order_of_time(&Solution::samples)) {
    const auto& [members, solution] = parts_[part];
    const Sample& of_part = solution.samples[number];
    const bool has_impact = of_part.v_minus != of_part.v_plus;
    if (!has_impact && !whole_.samples.empty() && whole_.samples.back().t == of_part.t) continue;
    Sample sample{.t = of_part.t, .q = {}, .v_minus = {}, .v_plus = {}};
    set_state(members, of_part, sample);
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
