#include "methods/elements/newton_system.h"

#include <algorithm>
#include <tuple>

#include "methods/elements/redundant_system.h"
#include "methods/linear_algebra/breadth_first.h"

namespace ricochet {
namespace {

// Unknowns up to which a system is one island: finding and gathering several would cost more than they save.
constexpr int kMaxOfOneIsland = 40;
// Unknowns up to which an island is dense.
constexpr int kMaxDense = 64;
// Pivots, relative to their column, below which contacts may be redundant: the inverse decides.
constexpr double kSuspicious = 1e-12;
// Factors kept per island: element lengths and active sets alternate (full step, rest after an impact, ...).
constexpr std::size_t kMaxFactors = 8;

}  // namespace

NewtonSystem::NewtonSystem(const Problem& problem, int n_s, Counters& counters)
    : problem_(problem),
      counters_(counters),
      n_q_(problem.n_q()),
      n_s_(n_s),
      constant_dynamics_(problem.info().structure.constant_mass && !problem.info().structure.force_uses_position &&
                         !problem.info().structure.force_uses_velocity) {}

/// Room for everything, at the first active set: scenes in closed form need none.
void NewtonSystem::make_room() {
  const auto n = static_cast<std::size_t>(n_q_);
  for (auto* list : {&island_of_, &coordinate_number_, &order_, &place_}) list->resize(n);
  for (auto* lists : {&coupled_, &contacts_of_}) lists->resize(n);
  for (const auto& [k, l] : problem_.info().structure.couplings) {
    coupled_[k].push_back(l);
    coupled_[l].push_back(k);
  }
  factors_.resize(n);
  scratch_.resize(n);
}

void NewtonSystem::set_active(std::span<const ActiveContact> closed, int n_rows) {
  if (factors_.empty()) make_room();
  closed_ = closed;
  recalled_h_ = 0;
  n_x_ = n_q_ + n_rows;
  row_number_.resize(n_rows);
  find_islands();
  set_members();
  for (std::size_t k = 0; k < n_islands_; ++k) {
    Island& island = islands_[k];
    const int n = n_s_ * (static_cast<int>(island.coordinates.size()) + island.n_rows);
    island.is_banded = false;
    if (n > kMaxDense) number_along_levels(island);
    if (!island.is_banded) number_by_stage(island);
  }
}

/// coordinate_sets_
void NewtonSystem::find_islands() {
  coordinate_sets_.reset(n_q_);
  if (n_s_ * n_x_ <= kMaxOfOneIsland) return coordinate_sets_.join_all();
  coordinate_sets_.join(problem_.info().structure.couplings);
  for (const ActiveContact& active : closed_) coordinate_sets_.join(problem_.info().contacts[active.contact].pushed());
}

/// Islands with their coordinates and contacts, from coordinate_sets_.
void NewtonSystem::set_members() {
  n_islands_ = 0;
  for (int c = 0; c < n_q_; ++c) {
    if (coordinate_sets_.of(c) == c) {
      if (n_islands_ == islands_.size()) islands_.emplace_back();
      Island& island = islands_[n_islands_];
      for (auto* list : {&island.coordinates, &island.contacts, &island.key}) list->clear();
      island.n_rows = 0;
      island.is_constant = constant_dynamics_;
      island_of_[c] = static_cast<int>(n_islands_++);
    }
    island_of_[c] = island_of_[coordinate_sets_.of(c)];
    islands_[island_of_[c]].coordinates.push_back(c);
  }
  for (std::size_t a = 0; a < closed_.size(); ++a) {
    const ActiveContact& active = closed_[a];
    const auto& contact = problem_.info().contacts[active.contact];
    Island& island = islands_[island_of_[contact.support.front()]];
    island.contacts.push_back(static_cast<int>(a));
    for (const int part : {active.contact, static_cast<int>(active.mode), active.facet}) island.key.push_back(part);
    island.n_rows += active.n_rows;
    // The direction of (7c) turns with the velocity.
    island.is_constant = island.is_constant && contact.is_affine && active.mode != ContactMode::slip;
  }
}

/// Stage after stage: accelerations, then forces, as in the whole system.
void NewtonSystem::number_by_stage(Island& island) {
  int number = 0;
  for (const int c : island.coordinates) coordinate_number_[c] = number++;
  for (const int a : island.contacts) {
    for (int row = 0; row < closed_[a].n_rows; ++row) row_number_[closed_[a].row + row] = number++;
  }
  island.couples.clear();
  set_unknowns(island, 1, number);
}

void NewtonSystem::set_unknowns(Island& island, int number_step, int stage_step) {
  const std::size_t n = island.coordinates.size() + static_cast<std::size_t>(island.n_rows);
  island.number_step = number_step;
  island.stage_step = stage_step;
  island.unknowns.resize(n * n_s_);
  for (int j = 0; j < n_s_; ++j) {
    for (const int c : island.coordinates) island.unknowns[island.position(coordinate_number_[c], j)] = j * n_x_ + c;
    for (const int a : island.contacts) {
      for (int row = closed_[a].row; row < closed_[a].row + closed_[a].n_rows; ++row)
        island.unknowns[island.position(row_number_[row], j)] = j * n_x_ + n_q_ + row;
    }
  }
  island.is_whole = n_islands_ == 1 && number_step == 1;
}

/// Coordinates of the island in order_, breadth first from `first`.
void NewtonSystem::order_by_levels(const Island& island, int first) {
  for (const int c : island.coordinates) place_[c] = -1;
  append_breadth_first(first, 0, order_, place_, [&](int c, auto visit) {
    for (const int other : coupled_[c]) visit(other);
    for (const int a : contacts_of_[c]) {
      for (const int other : problem_.info().contacts[closed_[a].contact].pushed()) visit(other);
    }
  });
}

/// From one end of the island to the other: a contact stands in the middle of its coordinates,
/// and the stages of each follow each other.
void NewtonSystem::number_along_levels(Island& island) {
  for (const int c : island.coordinates) contacts_of_[c].clear();
  for (const int a : island.contacts) {
    for (const int c : problem_.info().contacts[closed_[a].contact].pushed()) contacts_of_[c].push_back(a);
  }
  const auto last = island.coordinates.size() - 1;
  order_by_levels(island, island.coordinates.front());
  order_by_levels(island, order_[last]);  // an end

  struct Place {
    double at;
    int coordinate, contact;  // one of them -1
  };
  std::vector<Place> places;
  for (const int c : island.coordinates) places.push_back({static_cast<double>(place_[c]), c, -1});
  for (const int a : island.contacts) {
    const auto pushed = problem_.info().contacts[closed_[a].contact].pushed();
    double sum = 0;
    for (const int c : pushed) sum += place_[c];
    places.push_back({sum / static_cast<double>(pushed.size()), -1, a});
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::tie(a.at, a.contact, a.coordinate) < std::tie(b.at, b.contact, b.coordinate);
  });
  int number = 0;
  for (const Place& place : places) {
    if (place.coordinate >= 0) coordinate_number_[place.coordinate] = number++;
    for (int row = 0; place.contact >= 0 && row < closed_[place.contact].n_rows; ++row)
      row_number_[closed_[place.contact].row + row] = number++;
  }

  island.couples.clear();
  for (const int c : island.coordinates) {
    island.couples.emplace_back(c, c);
    for (const int other : coupled_[c]) island.couples.emplace_back(c, other);
  }
  for (const int a : island.contacts) {
    const auto& contact = problem_.info().contacts[closed_[a].contact];
    if (contact.is_affine) continue;
    for (const int c : contact.pushed()) {
      for (const int other : contact.pushed()) island.couples.emplace_back(c, other);
    }
  }
  std::sort(island.couples.begin(), island.couples.end());
  island.couples.erase(std::unique(island.couples.begin(), island.couples.end()), island.couples.end());

  int widest = 0;  // difference of the numbers of unknowns that share an entry
  for (const auto& [c, d] : island.couples)
    widest = std::max(widest, std::abs(coordinate_number_[c] - coordinate_number_[d]));
  for (const int a : island.contacts) {
    const int first = row_number_[closed_[a].row], after = first + closed_[a].n_rows - 1;
    for (const int c : problem_.info().contacts[closed_[a].contact].pushed())
      widest = std::max({widest, std::abs(coordinate_number_[c] - first), std::abs(coordinate_number_[c] - after)});
    widest = std::max(widest, after - first);
  }
  island.lower = island.upper = widest * n_s_ + n_s_ - 1;
  // Per solve a band takes n (2 lower + upper) multiplications and an inverse n^2, in half the time each.
  island.is_banded = 6 * island.lower < n_s_ * number;
  if (island.is_banded) set_unknowns(island, n_s_, 1);
}

NewtonSystem::Factor& NewtonSystem::factor_for(const Island& island, double h) {
  auto& kept = factors_[island.coordinates.front()];
  Factor* oldest = nullptr;
  for (auto& factor : kept) {
    if (factor.last_use > 0 && (factor.h == h || island.is_constant) && factor.key == island.key &&
        factor.n_coordinates == static_cast<int>(island.coordinates.size())) {
      factor.last_use = ++clock_;
      return factor;
    }
    if (!oldest || factor.last_use < oldest->last_use) oldest = &factor;
  }
  const bool is_free = oldest && oldest->last_use == 0;
  if (!is_free && kept.size() < kMaxFactors) {
    kept.reserve(kMaxFactors);  // they do not move
    oldest = &kept.emplace_back();
  }
  oldest->h = h;
  oldest->key = island.key;
  oldest->n_coordinates = static_cast<int>(island.coordinates.size());
  oldest->is_valid = false;
  oldest->last_use = ++clock_;
  return *oldest;
}

void NewtonSystem::forget_factors() {
  for (auto& of_island : factors_) {
    for (Factor& factor : of_island) {
      factor.is_valid = false;
      factor.last_use = 0;
    }
  }
  recalled_h_ = 0;
  is_known_ = false;
}

bool NewtonSystem::recall(double h) {
  if (h == recalled_h_ && is_known_) return true;
  recalled_h_ = h;
  is_known_ = true;
  is_redundant_ = false;
  for (std::size_t k = 0; k < n_islands_; ++k) {
    islands_[k].factor = &factor_for(islands_[k], h);
    is_known_ = is_known_ && islands_[k].factor->is_valid;
    is_redundant_ = is_redundant_ || islands_[k].factor->to_smallest.size() > 0;
  }
  return is_known_;
}

bool NewtonSystem::is_constant() const {
  return std::all_of(islands_.begin(), islands_.begin() + static_cast<std::ptrdiff_t>(n_islands_),
                     [](const Island& island) { return island.is_constant; });
}

/// Every entry of K of the island: add(row, column, value), several times for some.
void NewtonSystem::assemble(const Island& island, const StageCoefficients& k, const StageDerivatives& derivatives,
                            auto&& add) const {
  for (int j = 0; j < n_s_; ++j) {
    const double *M = derivatives.M[j], *Dq = derivatives.Dq[j].data(), *Dv = derivatives.Dv[j].data();
    const auto couple = [&](int c, int d) {
      const int at = d * n_q_ + c, row = island.position(coordinate_number_[c], j), number = coordinate_number_[d];
      add(row, island.position(number, j), M[at]);
      if (!derivatives.has_dynamics || (Dq[at] == 0 && Dv[at] == 0)) return;
      for (int l = 0; l < n_s_; ++l) add(row, island.position(number, l), k.h2A2(j, l) * Dq[at] + k.hA(j, l) * Dv[at]);
    };
    if (island.is_banded) {
      for (const auto& [c, d] : island.couples) couple(c, d);
    } else {
      for (const int c : island.coordinates) {
        for (const int d : island.coordinates) couple(c, d);
      }
    }
    for (const int a : island.contacts) {
      const ActiveContact& active = closed_[a];
      const auto& contact = problem_.info().contacts[active.contact];
      const auto number = [&](int row) { return row_number_[active.row + row]; };
      int entry = active.entry;
      for (int row = 0; row < active.n_rows; ++row) {
        const int at = island.position(number(row), j);
        for (const int c : contact.pushed()) {
          add(island.position(coordinate_number_[c], j), at, -derivatives.forces[j][entry]);
          const double Rq = derivatives.Rq[j][entry], Rv = derivatives.Rv[j][entry];
          for (int l = 0; l < n_s_; ++l)
            add(at, island.position(coordinate_number_[c], l), k.h2A2(j, l) * Rq + k.hA(j, l) * Rv);
          ++entry;
        }
        entry += contact.is_moving;  // the clock's acceleration is zero: its columns change nothing
        for (int other = 0; other < active.n_rows; ++other)
          add(at, island.position(number(other), j), derivatives.Rl[j][9 * a + 3 * row + other]);
      }
    }
  }
}

bool NewtonSystem::factorize(const Island& island, const StageCoefficients& k, const StageDerivatives& derivatives,
                             Factor& factor) const {
  factor.to_smallest.resize(0, 0);
  factor.negative_inverse.resize(0, 0);
  factor.is_banded = island.is_banded;
  if (factor.is_banded) {
    factor.band.set_zero(island.n(), island.lower, island.upper);
    assemble(island, k, derivatives, [&](int row, int column, double x) { factor.band.entry(row, column) += x; });
    factor.band.factorize();
    if (factor.band.smallest_pivot() > kSuspicious) return factor.is_valid = true;
    factor.is_banded = false;
  }
  factor.K.setZero(island.n(), island.n());
  assemble(island, k, derivatives, [&](int row, int column, double x) { factor.K(row, column) += x; });
  factor.lu.factorize(factor.K);
  const bool is_suspicious = !(factor.lu.smallest_pivot() > kSuspicious);
  if (is_suspicious || island.is_constant) factor.negative_inverse = -factor.lu.inverse();
  // Several contacts, or one with more forces than its bodies have ways to go: a pendulum that sticks to a wall.
  const bool may_be_redundant =
      island.contacts.size() > 1 || island.n_rows > static_cast<int>(island.coordinates.size());
  if (is_suspicious && may_be_redundant && RedundantSystem::is_singular(factor.K, factor.negative_inverse)) {
    const RedundantSystem system(factor.K, force_positions(island));
    factor.negative_inverse = -system.pseudo_inverse();
    factor.to_smallest = system.to_smallest();
  }
  return factor.is_valid = !is_suspicious || factor.negative_inverse.allFinite();
}

std::vector<int> NewtonSystem::force_positions(const Island& island) const {
  std::vector<int> positions;
  for (int j = 0; j < n_s_; ++j) {
    for (const int a : island.contacts) {
      for (int row = closed_[a].row; row < closed_[a].row + closed_[a].n_rows; ++row)
        positions.push_back(island.position(row_number_[row], j));
    }
  }
  return positions;
}

bool NewtonSystem::factorize(const StageCoefficients& k, const StageDerivatives& derivatives) {
  bool is_regular = true, is_counted = false;
  is_redundant_ = false;
  for (std::size_t m = 0; m < n_islands_ && is_regular; ++m) {
    const Island& island = islands_[m];
    if (!island.factor->is_valid || !island.is_constant) {
      is_regular = factorize(island, k, derivatives, *island.factor);
      is_counted = true;
    }
    is_redundant_ = is_redundant_ || island.factor->to_smallest.size() > 0;
  }
  if (is_counted) ++counters_.matrix_factorizations;
  return is_known_ = is_regular;
}

void NewtonSystem::solve(const Vector& r, const Vector& x, Vector& dx) {
  ++counters_.linear_solves;
  for (std::size_t m = 0; m < n_islands_; ++m) {
    const Island& island = islands_[m];
    const Factor& factor = *island.factor;
    const int n = island.n();
    const int* at = island.unknowns.data();
    if (factor.is_banded) {
      local_.resize(n);
      for (int i = 0; i < n; ++i) local_[i] = r[at[i]];
      factor.band.solve(local_.data());
      for (int i = 0; i < n; ++i) dx[at[i]] = -local_[i];
      continue;
    }
    result_.resize(n);
    double* to = island.is_whole ? dx.data() : result_.data();
    if (factor.negative_inverse.size() == 0) {
      for (int i = 0; i < n; ++i) to[i] = -r[at[i]];
      factor.lu.solve_in_place(to);
    } else {
      const double* column = factor.negative_inverse.data();
      std::fill_n(to, n, 0.0);
      for (int c = 0; c < n; ++c, column += n) {  // column by column: they are contiguous
        const double r_c = r[at[c]];
        for (int i = 0; i < n; ++i) to[i] += column[i] * r_c;
      }
    }
    for (int c = 0; c < n && factor.to_smallest.size() > 0; ++c) {
      for (int i = 0; i < n; ++i) to[i] -= factor.to_smallest(i, c) * x[at[c]];
    }
    for (int i = 0; i < n && !island.is_whole; ++i) dx[at[i]] = result_[i];
  }
}

void NewtonSystem::solve_once(const StageCoefficients& k, const StageDerivatives& derivatives, const Matrix& rhs,
                              const Vector& x, Matrix& response) {
  counters_.linear_solves += 2;
  response.resize(rhs.rows(), 2);
  recalled_h_ = 0;
  is_redundant_ = false;
  bool is_counted = false;
  for (std::size_t m = 0; m < n_islands_; ++m) {
    Island& island = islands_[m];
    const int n = island.n();
    const int* at = island.unknowns.data();
    Factor& factor = island.is_constant ? factor_for(island, k.h) : scratch_[island.coordinates.front()];
    if (!island.is_constant || !factor.is_valid) {
      factorize(island, k, derivatives, factor);
      is_counted = true;
    }
    is_redundant_ = is_redundant_ || factor.to_smallest.size() > 0;
    if (island.is_whole && !factor.is_banded && factor.to_smallest.size() == 0) {
      response = -rhs;
      factor.lu.solve_in_place(response.data(), 2);
      continue;
    }
    for (int column = 0; column < 2; ++column) {
      local_.resize(n);
      for (int i = 0; i < n; ++i) local_[i] = rhs(at[i], column);
      Eigen::Map<Vector> local(local_.data(), n);
      if (factor.is_banded) {
        factor.band.solve(local_.data());
        local = -local;
      } else if (factor.to_smallest.size() == 0) {
        local = -local;
        factor.lu.solve_in_place(local.data());
      } else {
        local = (factor.negative_inverse * local).eval();
        if (column == 0)
          local -= factor.to_smallest * x(island.unknowns);
        else
          local -= (factor.to_smallest * local).eval();
      }
      for (int i = 0; i < n; ++i) response(at[i], column) = local_[i];
    }
  }
  if (is_counted) ++counters_.matrix_factorizations;
}

}  // namespace ricochet
