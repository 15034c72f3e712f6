#include "reference/certified/mode_motion.h"

#include <algorithm>
#include <cmath>

#include "problems/disjoint_sets.h"
#include "reference/certified/redundant_rows.h"

namespace ricochet::reference::certified {

const char* name_of(Mode mode) {
  static const char* const names[] = {"open", "closed", "stick", "slip+", "slip-", "slip"};
  return names[static_cast<int>(mode)];
}

int slip_sign_of(Mode mode) {
  if (mode == Mode::slip_minus) return -1;
  return mode == Mode::slip_plus || mode == Mode::slip ? 1 : 0;
}

std::vector<std::string> names_of(const std::vector<Mode>& modes) {
  std::vector<std::string> names;
  for (const Mode mode : modes) names.emplace_back(name_of(mode));
  return names;
}

namespace {

/// Builds one ModeMotion.
class ModeEquations {
 public:
  ModeEquations(const SceneFormulas& scene, const std::vector<Mode>& modes, SeriesProgram& program,
                const LeftOut& left_out = {})
      : scene_(scene), modes_(modes), p_(program), left_out_(left_out), push_(scene.n, program.number(0)) {}

  void start_slip(int contact, const SlipOnset& onset) {
    SlipStart start;
    start.onset = onset;
    start.y = p_.state();
    start.turn = p_.state();
    const Ball zero;
    p_.set(start.y, 0, zero.get());
    motion_.starts[contact] = start;
  }

  ModeSystem system() {
    for (int i = 0; i < scene_.n_c(); ++i) motion_.friction[i].resize(scene_.contacts[i].n_t());  // of those left out
    add_unknowns();
    ModeSystem system;
    system.unknowns = unknowns_;
    system.A = p_.values_of(matrix());
    for (auto& row : system.A) {
      system.b.push_back(row.back());
      row.pop_back();
    }
    return system;
  }

  ModeMotion derive() {
    for (int i = 0; i < scene_.n_c(); ++i) {
      if (modes_[i] == Mode::stick) motion_.friction[i].resize(scene_.contacts[i].n_t());
    }
    add_unknowns();
    const std::vector<Node> solution = eliminate();
    motion_.acceleration.assign(solution.begin(), solution.begin() + scene_.n);
    for (std::size_t j = 0; j < unknowns_.size(); ++j) {
      const auto [contact, direction] = unknowns_[j];
      const Node force = solution[scene_.n + j];
      if (direction < 0)
        motion_.normal_force[contact] = force;
      else
        motion_.friction[contact][direction] = force;
    }
    for (auto& [contact, start] : motion_.starts) follow_direction(scene_.contacts[contact], start);
    find_equal_velocities();
    for (int i = 0; i < scene_.n_c(); ++i) add_events(i);
    for (int k = 0; k < std::ssize(scene_.borders); ++k)
      motion_.events.push_back({.node = scene_.borders[k].function, .kind = EventKind::border, .border = k});
    collect_schedule();
    return std::move(motion_);
  }

 private:
  Node bias(Node rate) { return bias_of(rate, scene_, p_); }

  void add_unknowns() {
    for (int i = 0; i < scene_.n_c(); ++i) {
      if (modes_[i] != Mode::open) add_normal(i);
    }
    for (int i = 0; i < scene_.n_c(); ++i) {
      if (modes_[i] == Mode::stick) add_friction(i);
    }
  }

  void add_normal(int i) {
    const ContactFormulas& contact = scene_.contacts[i];
    std::vector<Node> column = contact.J_n;
    const Node mu = contact.mu_formula;
    for (int r = 0; r < scene_.n; ++r) {
      const auto along = [&](int d) { return p_.mul(mu, contact.J_t[d][r]); };
      if (modes_[i] == Mode::slip_plus) column[r] = p_.sub(column[r], along(0));
      if (modes_[i] == Mode::slip_minus) column[r] = p_.add(column[r], along(0));
      if (modes_[i] != Mode::slip) continue;
      const std::vector<Node> direction = direction_of(i);
      for (int d = 0; d < 2; ++d) column[r] = p_.sub(column[r], p_.mul(direction[d], along(d)));
    }
    add_unknown({i, -1}, column, contact.J_n, contact.v_n);
  }

  /// v_t / |v_t|, or (d + y e) / sqrt(1 + y^2) where slip begins.
  std::vector<Node> direction_of(int i) {
    std::vector<Node> slip = scene_.contacts[i].v_t;
    Node length = p_.dot(slip, slip);
    if (const auto start = motion_.starts.find(i); start != motion_.starts.end()) {
      const Node y = start->second.y, d_0 = p_.constant(start->second.onset.d[0]),
                 d_1 = p_.constant(start->second.onset.d[1]);
      slip = {p_.sub(d_0, p_.mul(y, d_1)), p_.add(d_1, p_.mul(y, d_0))};
      length = p_.add(p_.number(1), p_.mul(y, y));
    }
    length = p_.sqrt(length);
    return {p_.div(slip[0], length), p_.div(slip[1], length)};
  }

  /// The nodes of a SlipStart.
  void follow_direction(const ContactFormulas& contact, SlipStart& start) {
    std::vector<Node> rate;  // dv_t/dt
    for (int d = 0; d < 2; ++d)
      rate.push_back(p_.add(bias(contact.v_t[d]), p_.dot(contact.J_t[d], motion_.acceleration)));
    const std::vector<Node> d{p_.constant(start.onset.d[0]), p_.constant(start.onset.d[1])}, e{p_.neg(d[1]), d[0]};
    start.S = p_.dot(d, contact.v_t);
    start.E = p_.sub(p_.dot(e, rate), p_.mul(start.y, p_.dot(d, rate)));
    start.F = p_.derivative(start.E, start.y);
    start.product = p_.mul(start.S, start.turn);
  }

  void add_friction(int i) {
    const ContactFormulas& contact = scene_.contacts[i];
    for (int d = 0; d < contact.n_t(); ++d) add_unknown({i, d}, contact.J_t[d], contact.J_t[d], contact.v_t[d]);
  }

  void add_unknown(Unknown label, const std::vector<Node>& column, const std::vector<Node>& row, Node rate) {
    if (const auto left_out = left_out_.find(label); left_out != left_out_.end()) {
      const Node force = p_.constant(Ball(left_out->second));
      (label.second < 0 ? motion_.normal_force[label.first] : motion_.friction[label.first][label.second]) = force;
      for (int r = 0; r < scene_.n; ++r) push_[r] = p_.add(push_[r], p_.mul(column[r], force));
      return;
    }
    unknowns_.push_back(label);
    columns_.push_back(column);
    rows_.push_back(row);
    right_.push_back(p_.neg(bias(rate)));
  }

  /// Equations (1) to (3), the right-hand side last.
  std::vector<std::vector<Node>> matrix() {
    const int n = scene_.n, m = static_cast<int>(unknowns_.size()), size = n + m;
    std::vector<std::vector<Node>> A(size, std::vector<Node>(size + 1, p_.number(0)));
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) A[r][c] = scene_.M[r][c];
      for (int c = 0; c < m; ++c) A[r][n + c] = p_.neg(columns_[c][r]);
      A[r][size] = p_.add(scene_.f[r], push_[r]);
    }
    for (int r = 0; r < m; ++r) {
      for (int c = 0; c < n; ++c) A[n + r][c] = rows_[r][c];
      A[n + r][size] = right_[r];
    }
    return A;
  }

  std::vector<Node> eliminate() {
    std::vector<std::vector<Node>> A = matrix();
    const int size = static_cast<int>(A.size());
    for (int i = 0; i < size; ++i) eliminate_column(A, i);
    std::vector<Node> solution(size);
    for (int i = size - 1; i >= 0; --i) {
      Node sum = A[i][size];
      for (int c = i + 1; c < size; ++c) sum = p_.sub(sum, p_.mul(A[i][c], solution[c]));
      solution[i] = p_.div(sum, A[i][i]);
    }
    return solution;
  }

  /// The pivot is the largest entry that is certainly not zero.
  void eliminate_column(std::vector<std::vector<Node>>& A, int i) {
    const int size = static_cast<int>(A.size());
    int pivot = -1;
    double largest = 0;
    for (int r = i; r < size; ++r) {
      if (p_.is_zero(A[r][i])) continue;
      const Ball value = p_.value_of(A[r][i]);
      if (value.sign() == Sign::unknown || !(std::abs(value.nearest()) > largest)) continue;
      largest = std::abs(value.nearest());
      pivot = r;
    }
    if (pivot < 0) throw Undecided("the equations of motion may be singular (redundant contacts)");
    std::swap(A[i], A[pivot]);
    for (int r = i + 1; r < size; ++r) {
      if (p_.is_zero(A[r][i])) continue;
      const Node factor = p_.div(A[r][i], A[i][i]);
      for (int c = i + 1; c <= size; ++c) A[r][c] = p_.sub(A[r][c], p_.mul(factor, A[i][c]));
    }
  }

  void add_events(int i) {
    const ContactFormulas& contact = scene_.contacts[i];
    auto& events = motion_.events;
    if (modes_[i] == Mode::open) {
      events.push_back({contact.gap, EventKind::impact, i});
      return;
    }
    const Node force = motion_.normal_force[i];
    // A force that is zero by its formula pushes as little as an open contact; it never pulls.
    if (!contact.is_bilateral && !p_.is_zero(force)) events.push_back({force, EventKind::detach, i});
    if (modes_[i] == Mode::slip_plus) add_slip_end(i, slip_velocity(i));
    if (modes_[i] == Mode::slip_minus) add_slip_end(i, p_.neg(slip_velocity(i)));
    if (modes_[i] == Mode::slip) {
      const auto start = motion_.starts.find(i);
      const Node slip = start != motion_.starts.end() ? start->second.S : p_.dot(contact.v_t, contact.v_t);
      events.push_back({slip, EventKind::slip_end, i});
    }
    if (modes_[i] != Mode::stick) return;
    const Node bound = p_.mul(contact.mu_formula, force);
    const auto& friction = motion_.friction[i];
    if (p_.is_zero(bound) && p_.is_zero(friction[0])) return;  // no force acts
    if (contact.n_t() == 1) {
      events.push_back({p_.sub(bound, friction[0]), EventKind::cone, i, 1});
      events.push_back({p_.add(bound, friction[0]), EventKind::cone, i, -1});
    } else {
      events.push_back({p_.sub(p_.mul(bound, bound), p_.dot(friction, friction)), EventKind::cone, i});
    }
  }

  /// Velocities that are zero, or the same, as long as the modes last.
  void find_equal_velocities() {
    velocity_ = scene_.v;
    const std::vector<int> locked = locked_by(scene_, modes_, true, p_);
    DisjointSets same(scene_.n);
    for (int i = 0; i < scene_.n_c() && !locked.empty(); ++i) {
      const ContactFormulas& contact = scene_.contacts[i];
      if (modes_[i] == Mode::open || !is_at_rest_with_its_bodies(scene_, i, p_)) continue;
      std::vector<int> left;
      for (int k = 0; k < scene_.n; ++k) {
        if (!p_.is_zero(contact.J_n[k]) && std::ranges::count(locked, k) == 0) left.push_back(k);
      }
      if (left.size() != 2 || p_.value_of(contact.J_n[left[0]]).sign() == Sign::unknown) continue;
      if (std::ranges::count(contact.opposite_slopes, std::pair(left[0], left[1])) > 0) same.join(left[0], left[1]);
    }
    for (int k = 0; k < scene_.n; ++k) velocity_[k] = scene_.v[same.of(k)];
    for (const int k : locked) velocity_[k] = p_.number(0);
  }

  /// The slip velocity with these velocities, if it does not depend on time.
  Node slip_velocity(int i) {
    const ContactFormulas& contact = scene_.contacts[i];
    return is_at_rest_with_its_bodies(scene_, i, p_) ? p_.dot(contact.J_t[0], velocity_) : contact.v_t[0];
  }

  void add_slip_end(int i, Node slip) {
    for (EventFunction& event : motion_.events) {
      if (event.kind == EventKind::slip_end && event.node == slip) return event.with.push_back(i);
    }
    motion_.events.push_back({slip, EventKind::slip_end, i});
  }

  void collect_schedule() {
    std::vector<Node> outputs = motion_.acceleration;
    const auto append = [&](const std::vector<Node>& nodes) {
      outputs.insert(outputs.end(), nodes.begin(), nodes.end());
    };
    append(scene_.q);
    append(scene_.v);
    outputs.push_back(scene_.clock);
    for (const auto& event : motion_.events) outputs.push_back(event.node);
    for (const auto& [contact, start] : motion_.starts) append({start.y, start.S, start.E, start.F});
    for (const auto& contact : scene_.contacts) {
      outputs.push_back(contact.gap);
      append(contact.v_t);
    }
    motion_.schedule = p_.schedule(outputs);
  }

  const SceneFormulas& scene_;
  const std::vector<Mode>& modes_;
  SeriesProgram& p_;
  ModeMotion motion_;
  const LeftOut left_out_;
  std::vector<Node> push_;      ///< n, by forces that are left out
  std::vector<Node> velocity_;  ///< v, see find_equal_velocities()
  std::vector<Unknown> unknowns_;
  std::vector<std::vector<Node>> columns_, rows_;
  std::vector<Node> right_;
};

}  // namespace

void require_bounds(const SceneFormulas& scene, const std::vector<Mode>& modes) {
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (scene.contacts[i].is_friction_element && modes[i] == Mode::open)
      throw Unsupported(fmt::format("the bound of friction element '{}' becomes negative", scene.contacts[i].name));
  }
}

ModeMotion mode_motion(const SceneFormulas& scene, const std::vector<Mode>& modes, SeriesProgram& program,
                       const std::map<int, SlipOnset>& starting, const LeftOut& left_out) {
  ModeEquations equations(scene, modes, program, left_out);
  for (const auto& [contact, onset] : starting) equations.start_slip(contact, onset);
  return equations.derive();
}

Node bias_of(Node rate, const SceneFormulas& scene, SeriesProgram& p) {
  Node sum = p.derivative(rate, scene.clock);
  for (int k = 0; k < scene.n; ++k) sum = p.add(sum, p.mul(p.derivative(rate, scene.q[k]), scene.v[k]));
  return sum;
}

ModeSystem mode_system(const SceneFormulas& scene, const std::vector<Mode>& modes, SeriesProgram& program,
                       const LeftOut& left_out) {
  return ModeEquations(scene, modes, program, left_out).system();
}

bool is_at_rest_with_its_bodies(const SceneFormulas& scene, int i, SeriesProgram& program) {
  const ContactFormulas& contact = scene.contacts[i];
  for (int d = 0; d < contact.n_t(); ++d) {
    if (contact.v_t[d] != program.dot(contact.J_t[d], scene.v)) return false;
    for (const Node entry : contact.J_t[d]) {
      if (!program.is_zero(program.derivative(entry, scene.clock))) return false;
    }
  }
  return program.is_zero(program.derivative(contact.gap, scene.clock));
}

std::vector<int> locked_by(const SceneFormulas& scene, const std::vector<Mode>& modes, bool by_formulas,
                           SeriesProgram& program) {
  struct Row {
    const std::vector<Node>* nodes;
    std::vector<Ball> values;
  };
  std::vector<Row> rows;
  for (int i = 0; i < scene.n_c(); ++i) {
    if (modes[i] == Mode::open || !is_at_rest_with_its_bodies(scene, i, program)) continue;
    const ContactFormulas& contact = scene.contacts[i];
    rows.push_back({&contact.J_n, {}});
    for (const auto& direction : contact.J_t) {
      if (modes[i] == Mode::stick) rows.push_back({&direction, {}});
    }
  }
  BallMatrix values;
  for (Row& row : rows) {
    row.values = program.values_of(*row.nodes);
    values.push_back(row.values);
  }
  std::vector<int> locked = locked_coordinates(values, program.precision());
  while (by_formulas && !locked.empty()) {
    const auto stays = [&](const Row& row) {
      for (std::size_t k = 0; k < row.nodes->size(); ++k) {
        if (!program.is_zero((*row.nodes)[k]) && std::ranges::count(locked, static_cast<int>(k)) == 0) return false;
      }
      return true;
    };
    values.clear();
    for (const Row& row : rows) {
      if (stays(row)) values.push_back(row.values);
    }
    const std::vector<int> rest = locked_coordinates(values, program.precision());
    if (rest == locked) break;
    locked = rest;
  }
  return locked;
}

std::vector<int> pushed_coordinates(const SceneFormulas& scene, const std::vector<int>& contacts,
                                    const SeriesProgram& program) {
  const MomentumGroups groups = momentum_groups(scene, contacts, program);
  std::vector<int> pushed;
  for (int k = 0; k < scene.n; ++k) {
    if (std::ranges::count(groups.of_contact, groups.of_coordinate[k]) > 0) pushed.push_back(k);
  }
  return pushed;
}

namespace {

/// Coordinates between which M and `contacts` pass momentum. @param first  one coordinate of each contact, or -1
DisjointSets momentum_sets(const SceneFormulas& scene, const std::vector<int>& contacts, const SeriesProgram& program,
                           std::vector<int>& first) {
  DisjointSets sets(scene.n);
  for (int a = 0; a < scene.n; ++a) {
    for (int b = 0; b < scene.n; ++b) {
      if (!program.is_zero(scene.M[a][b])) sets.join(a, b);
    }
  }
  for (const int i : contacts) {
    const ContactFormulas& contact = scene.contacts[i];
    int begin = -1;
    for (int k = 0; k < scene.n; ++k) {
      bool pushes = !program.is_zero(contact.J_n[k]);
      for (const auto& direction : contact.J_t) pushes = pushes || !program.is_zero(direction[k]);
      if (!pushes) continue;
      if (begin < 0) begin = k;
      sets.join(begin, k);
    }
    first.push_back(begin);
  }
  return sets;
}

/// The coordinates of the variables, positions or velocities, that `formulas` contain.
std::vector<int> coordinates_in(const std::vector<Node>& formulas, const SceneFormulas& scene,
                                const SeriesProgram& program) {
  const std::vector<Node> nodes = program.schedule(formulas);
  const auto contains = [&](Node node) { return std::binary_search(nodes.begin(), nodes.end(), node); };
  std::vector<int> coordinates;
  for (int k = 0; k < scene.n; ++k) {
    if (contains(scene.q[k]) || contains(scene.v[k])) coordinates.push_back(k);
  }
  return coordinates;
}

}  // namespace

MomentumGroups momentum_groups(const SceneFormulas& scene, const std::vector<int>& contacts,
                               const SeriesProgram& program) {
  std::vector<int> first;
  DisjointSets sets = momentum_sets(scene, contacts, program, first);
  MomentumGroups groups;
  for (int k = 0; k < scene.n; ++k) groups.of_coordinate.push_back(sets.of(k));
  for (std::size_t k = 0; k < contacts.size(); ++k)
    groups.of_contact.push_back(first[k] < 0 ? -1 - contacts[k] : sets.of(first[k]));
  return groups;
}

std::vector<std::vector<int>> independent_parts(const SceneFormulas& scene, const std::vector<int>& contacts,
                                                const SeriesProgram& program) {
  std::vector<int> first;
  DisjointSets sets = momentum_sets(scene, contacts, program, first);
  for (int k = 0; k < scene.n; ++k) {
    std::vector<Node> formulas = scene.M[k];
    formulas.push_back(scene.f[k]);
    for (const int other : coordinates_in(formulas, scene, program)) sets.join(k, other);
  }
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (first[k] < 0) return {contacts};
    const ContactFormulas& contact = scene.contacts[contacts[k]];
    std::vector<Node> formulas{contact.gap};  // with all variables of J_n, as v_t with all of J_t
    formulas.insert(formulas.end(), contact.v_t.begin(), contact.v_t.end());
    for (const int other : coordinates_in(formulas, scene, program)) sets.join(first[k], other);
  }
  std::map<int, std::vector<int>> parts;
  for (std::size_t k = 0; k < contacts.size(); ++k) parts[sets.of(first[k])].push_back(contacts[k]);
  std::vector<std::vector<int>> list;
  for (auto& [label, part] : parts) list.push_back(std::move(part));
  return list;
}

std::vector<int> with_closed(std::vector<int> contacts, const std::vector<Mode>& modes) {
  const std::size_t n = contacts.size();
  for (int j = 0; j < std::ssize(modes); ++j) {
    if (modes[j] != Mode::open && std::count(contacts.begin(), contacts.begin() + n, j) == 0) contacts.push_back(j);
  }
  return contacts;
}

std::vector<int> coupled_contacts(const SceneFormulas& scene, const std::vector<Mode>& modes,
                                  const std::vector<int>& contacts, const SeriesProgram& program) {
  const std::vector<int> all = with_closed(contacts, modes);
  const std::vector<int> labels = momentum_groups(scene, all, program).of_contact;
  const auto end_of_own = labels.begin() + std::ssize(contacts);
  std::vector<int> coupled;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (std::find(labels.begin(), end_of_own, labels[k]) != end_of_own) coupled.push_back(all[k]);
  }
  return coupled;
}

}  // namespace ricochet::reference::certified
