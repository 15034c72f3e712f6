#include "problems/scene_file/control_fields.h"

#include <cmath>
#include <limits>

#include "problems/control/controls_csv.h"
#include "problems/join.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using Expressions = SymbolicModel::Expressions;
using Bounds = OptimalControlProblem::Bounds;

class ControlReader {
 public:
  ControlReader(const Field& control, SymbolicModel model, const ExpressionNames& in_state,
                std::filesystem::path folder)
      : control_(control),
        model_(std::move(model)),
        constants_(in_state),
        in_state_(in_state),
        folder_(std::move(folder)) {
    constants_.scalars.erase("t");
    constants_.vectors.clear();
    in_state_and_control_ = in_state;
    in_state_and_control_.vectors["u"] = model_.u;
  }

  std::unique_ptr<OptimalControlProblem> read() {
    require_plant();
    read_names();
    problem_->n_intervals = control_.at("N").value().get<int>();
    if (control_.has("elements")) problem_->n_fe = control_.at("elements").value().get<int>();
    if (control_.has("tableau")) problem_->tableau = control_.at("tableau").text();
    read_costs();
    path_ = read_constraints("path", in_state_and_control_, problem_->path_names);
    terminal_ = read_constraints("terminal", in_state_, problem_->terminal_names);
    const std::size_t n_q = model_.q.size();
    problem_->q = read_bounds("q", n_q);
    problem_->v = read_bounds("v", n_q);
    problem_->u = read_bounds("u", model_.u.size());
    read_time_bounds();
    read_guess();
    if (control_.has("goal")) problem_->goal = numbers_of(control_.at("goal"), n_q);
    make_plant();
    return std::move(problem_);
  }

 private:
  /// Rejects what the methods of optimal control would not see.
  void require_plant() const {
    const auto refuse = [&](std::string_view field, std::string_view value, std::string_view allowed) {
      throw InputError(fmt::format("{} beside {}", control_.name(), field), value, allowed);
    };
    if (model_.u.empty()) refuse("u", "''", "a scene with Bu and u is required, the control");
    if (model_.until) refuse("until", "a formula", "a scene without it is required: a control problem ends at T");
    if (const auto law = model_.impact_law.hypothesis; law != ImpactHypothesis::newton)
      refuse("impact_law", name_of(law), "newton is required, the only law of optimal control");
    for (const auto& contact : model_.contacts) {
      if (contact.eps_r.has(model_.v_n))
        refuse(fmt::format("contact '{}'", contact.name), "e as a formula of vn",
               "a coefficient that does not depend on vn is required");
    }
    for (std::size_t c = 0; c < model_.control.size(); ++c) {
      if (model_.control[c].has(model_.t))
        refuse(fmt::format("u[{}]", c), "a formula of t",
               "a formula of the parameters is required, the first guess; control.guess takes a table of values");
    }
  }

  /// Names of controls stand for u[k] in formulas.
  void read_names() {
    if (!control_.has("names")) return;
    const Field names = control_.at("names");
    names.require_size(model_.u.size());
    for (std::size_t c = 0; c < names.size(); ++c) {
      const Field field = names.at(c);
      require_free_name(field.text(), field);
      if (!in_state_and_control_.scalars.emplace(field.text(), model_.u[c]).second)
        throw InputError(field.name(), field.text(),
                         "a parameter or another control has this name; another one is required");
    }
  }

  void read_costs() {
    running_cost_ = control_.at("running_cost").expression(in_state_and_control_);
    if (control_.has("terminal_cost")) terminal_cost_ = control_.at("terminal_cost").expression(in_state_);
    running_residuals_ = read_squares("running_squares", in_state_and_control_, running_cost_);
    terminal_residuals_ = read_squares("terminal_squares", in_state_, terminal_cost_);
  }

  /// Residuals sqrt(weight) (value - reference), whose squares are added to `cost`.
  Expressions read_squares(const char* key, const ExpressionNames& names, ex& cost) const {
    Expressions residuals;
    if (!control_.has(key)) return residuals;
    const Field list = control_.at(key);
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Field entry = list.at(k);
      ex difference = entry.at("value").expression(names), weight = 1;
      if (entry.has("reference")) difference -= entry.at("reference").expression(names);
      if (entry.has("weight")) {
        const Field field = entry.at("weight");
        if (const double value = number_of(field); !(value >= 0))
          throw InputError(field.name(), value, "a number >= 0 is required");
        weight = field.expression(constants_);
      }
      residuals.push_back(GiNaC::sqrt(weight) * difference);
      cost += residuals.back() * residuals.back();
    }
    return residuals;
  }

  Expressions read_constraints(const char* key, const ExpressionNames& names, std::vector<std::string>& labels) const {
    Expressions formulas;
    if (!control_.has(key)) return formulas;
    const Field list = control_.at(key);
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Field entry = list.at(k);
      formulas.push_back(entry.at("value").expression(names));
      labels.push_back(entry.has("name") ? entry.at("name").text() : fmt::format("{} {}", key, k));
    }
    return formulas;
  }

  double number_of(const Field& field) const {
    const double value = model_.number(field.expression(constants_));
    if (!std::isfinite(value)) throw InputError(field.name(), field.text(), "a finite number is required");
    return value;
  }

  Vector numbers_of(const Field& field, std::size_t size) const {
    field.require_size(size);
    Vector values(static_cast<Eigen::Index>(size));
    for (std::size_t k = 0; k < size; ++k) values[static_cast<Eigen::Index>(k)] = number_of(field.at(k));
    return values;
  }

  /// [lower, upper], where null stands for no bound.
  std::pair<double, double> read_pair_of_bounds(const Field& field) const {
    field.require_size(2);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double lower = field.at(0).value().is_null() ? -infinity : number_of(field.at(0)),
                 upper = field.at(1).value().is_null() ? infinity : number_of(field.at(1));
    if (!(lower <= upper))
      throw InputError(field.name(), fmt::format("[{:g}, {:g}]", lower, upper), "lower <= upper is required");
    return {lower, upper};
  }

  Bounds read_bounds(const char* key, std::size_t size) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto n = static_cast<Eigen::Index>(size);
    Bounds bounds{Vector::Constant(n, -infinity), Vector::Constant(n, infinity)};
    if (!control_.has("bounds") || !control_.at("bounds").has(key)) return bounds;
    const Field list = control_.at("bounds").at(key);
    list.require_size(size);
    for (Eigen::Index k = 0; k < n; ++k)
      std::tie(bounds.lower[k], bounds.upper[k]) = read_pair_of_bounds(list.at(static_cast<std::size_t>(k)));
    return bounds;
  }

  void read_time_bounds() {
    if (!control_.has("bounds") || !control_.at("bounds").has("T")) return;
    const Field field = control_.at("bounds").at("T");
    const auto [lower, upper] = read_pair_of_bounds(field);
    if (!(lower > 0) || !std::isfinite(upper))
      throw InputError(field.name(), fmt::format("[{:g}, {:g}]", lower, upper),
                       "0 < lower <= upper is required, both finite");
    if (const double T = model_.number(model_.end_time); T < lower || T > upper)
      throw InputError(fmt::format("{} beside T", control_.name()), T,
                       fmt::format("a guess in bounds.T, [{:g}, {:g}], is required", lower, upper));
    problem_->is_time_free = true;
    problem_->T_lower = lower;
    problem_->T_upper = upper;
  }

  /// The guess: u of the scene, n_u values, a table with a row of n_u values per interval, or a file with such rows. With
  /// rows, u of the scene becomes the first of them.
  void read_guess() {
    const auto n_u = static_cast<Eigen::Index>(model_.u.size());
    if (control_.has("guess")) {
      const Field guess = control_.at("guess");
      if (guess.value().is_string()) {
        const std::string path = (folder_ / guess.text()).string();
        problem_->u_guess = read_controls(path, static_cast<int>(n_u));
        for (Eigen::Index c = 0; c < n_u; ++c) {
          for (const double u : problem_->u_guess.row(c))
            require_in_bounds(u, c, fmt::format("{}: {}", guess.name(), path));
          model_.control[static_cast<std::size_t>(c)] = problem_->u_guess(c, 0);
        }
        return;
      }
      const bool is_table = guess.size() > 0 && guess.at(0).value().is_array();
      if (is_table) {
        guess.require_size(static_cast<std::size_t>(problem_->n_intervals));
        problem_->u_guess.resize(n_u, problem_->n_intervals);
        for (Eigen::Index k = 0; k < problem_->n_intervals; ++k) {
          const Field row = guess.at(static_cast<std::size_t>(k));
          if (!row.value().is_array())
            throw InputError(row.name(), row.text(), "a row of values is required, as in the first interval");
          problem_->u_guess.col(k) = numbers_of(row, model_.u.size());
          require_in_bounds(problem_->u_guess.col(k), row);
        }
        model_.control.clear();
        for (std::size_t c = 0; c < model_.u.size(); ++c)
          model_.control.push_back(guess.at(std::size_t{0}).at(c).expression(constants_));
        return;
      }
      guess.require_size(model_.u.size());
      for (std::size_t c = 0; c < guess.size(); ++c) {
        if (guess.at(c).value().is_array())
          throw InputError(guess.at(c).name(), "a list", "a value is required, as for the first control");
      }
      model_.control = guess.expressions(model_.u.size(), constants_);
      require_in_bounds(numbers_of(guess, model_.u.size()), guess);
      return;
    }
    for (Eigen::Index c = 0; c < n_u; ++c)
      require_in_bounds(model_.number(model_.control[static_cast<std::size_t>(c)]), c, fmt::format("u[{}]", c));
  }

  void require_in_bounds(const Vector& u, const Field& field) const {
    for (Eigen::Index c = 0; c < u.size(); ++c)
      require_in_bounds(u[c], c, field.at(static_cast<std::size_t>(c)).name());
  }
  void require_in_bounds(double u, Eigen::Index c, const std::string& place) const {
    if (u < problem_->u.lower[c] || u > problem_->u.upper[c])
      throw InputError(place, u,
                       fmt::format("a guess in the bounds [{:g}, {:g}] of u[{}] is required", problem_->u.lower[c],
                                   problem_->u.upper[c], c));
  }

  /// The plant, and the functions in its coordinates: those of the scene, of friction elements, and the clock, which is
  /// the symbol t and which there is if a formula of the block depends on it.
  void make_plant() {
    for (const auto* list : {&path_, &terminal_}) {
      for (const ex& formula : *list) model_.has_clock = model_.has_clock || formula.has(model_.t);
    }
    model_.has_clock = model_.has_clock || running_cost_.has(model_.t) || terminal_cost_.has(model_.t);
    auto plant = std::make_unique<SymbolicProblem>(std::move(model_));
    const SymbolicModel& equations = plant->equations();
    for (Bounds* bounds : {&problem_->q, &problem_->v}) {
      const Eigen::Index stated = bounds->lower.size(), n = plant->n_q();
      constexpr double infinity = std::numeric_limits<double>::infinity();
      bounds->lower.conservativeResize(n);
      bounds->upper.conservativeResize(n);
      bounds->lower.tail(n - stated).setConstant(-infinity);
      bounds->upper.tail(n - stated).setConstant(infinity);
    }
    if (const Eigen::Index stated = problem_->goal.size(); stated > 0) {
      problem_->goal.conservativeResize(plant->n_q());
      problem_->goal.tail(plant->n_q() - stated).setZero();
    }
    const auto state = join<GiNaC::symbol>({equations.q, equations.v});
    const auto state_and_control = join<GiNaC::symbol>({equations.q, equations.v, equations.u});
    const auto constants = equations.constants();
    problem_->running_cost = {{running_cost_}, state_and_control, constants};
    problem_->terminal_cost = {{terminal_cost_}, state, constants};
    if (!running_residuals_.empty()) problem_->running_residuals = {running_residuals_, state_and_control, constants};
    if (!terminal_residuals_.empty()) problem_->terminal_residuals = {terminal_residuals_, state, constants};
    if (!path_.empty()) problem_->path = {path_, state_and_control, constants};
    if (!terminal_.empty()) problem_->terminal = {terminal_, state, constants};
    problem_->id = equations.id;
    problem_->title = equations.title;
    problem_->source = equations.source;
    problem_->hard_feature = equations.hard_feature;
    problem_->plant = std::move(plant);
  }

  Field control_;
  SymbolicModel model_;
  ExpressionNames constants_, in_state_, in_state_and_control_;
  const std::filesystem::path folder_;
  std::unique_ptr<OptimalControlProblem> problem_ = std::make_unique<OptimalControlProblem>();
  ex running_cost_ = 0, terminal_cost_ = 0;
  Expressions running_residuals_, terminal_residuals_, path_, terminal_;
};

}  // namespace

std::unique_ptr<OptimalControlProblem> make_control_problem(const Field& control, SymbolicModel model,
                                                            const ExpressionNames& in_state,
                                                            const std::filesystem::path& folder) {
  return ControlReader(control, std::move(model), in_state, folder).read();
}

}  // namespace ricochet
