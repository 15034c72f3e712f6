#include "reference/certified/scene_formulas.h"

#include <fmt/format.h>
#include <ginac/ginac.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>

#include "problems/derivatives/canonical_order.h"
#include "problems/derivatives/friction_elements.h"
#include "problems/derivatives/rolling_friction.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/levers.h"

namespace ricochet::reference::certified {

/// Exact formulas of a region. Those of another region of the same problem have the same symbols.
struct RegionFormulas {
  struct Contact {
    GiNaC::ex gap;
    std::vector<GiNaC::ex> directions;  ///< tangents and drives, without a mu that varies
    GiNaC::ex mu;                       ///< where it varies, positive: it changes no sign of slip; else 1
  };
  std::vector<GiNaC::ex> mass;
  std::vector<Contact> contacts;
  std::vector<GiNaC::ex> functions;  ///< psi_k
};

namespace {

using GiNaC::ex;
using GiNaC::numeric;

/// A double or an inexact number of GiNaC as a rational number.
numeric as_read(double value, Reading reading) {
  return reading == Reading::decimal ? shortest_decimal(value) : exact_value(value);
}

/// Replaces every number of a formula by a rational number.
struct ExactNumbers : GiNaC::map_function {
  explicit ExactNumbers(Reading r) : reading(r) {}
  ex operator()(const ex& e) override {
    if (!GiNaC::is_a<numeric>(e)) return e.map(*this);
    const auto& number = GiNaC::ex_to<numeric>(e);
    if (number.is_integer() || (number.is_rational() && reading == Reading::decimal)) return e;
    if (!number.is_real()) throw Unsupported("a formula contains a complex number");
    return as_read(number.to_double(), reading);
  }
  Reading reading;
};

/// Rules of angles, for all real numbers: cos(x)^2 = 1 - sin(x)^2, the addition theorems, and
///
///     (cos, sin)(-x) = (cos x, -sin x),   (cos, sin)(asin s) = (sqrt(1 - s^2), s)                                   (1)
///     (cos, sin)(atan2(y, x)) = (x, y) / sqrt(x^2 + y^2)                                                            (2)
struct AngleRules : GiNaC::map_function {
  ex operator()(const ex& e) override {
    const ex inner = e.map(*this);
    if (GiNaC::is_a<GiNaC::power>(inner) && is_call(inner.op(0), "cos") &&
        inner.op(1).info(GiNaC::info_flags::posint) && GiNaC::ex_to<numeric>(inner.op(1)) <= 20) {
      const int n = GiNaC::ex_to<numeric>(inner.op(1)).to_int();
      const ex x = inner.op(0).op(0);
      return pow(1 - pow(GiNaC::sin(x), 2), n / 2) * pow(GiNaC::cos(x), n % 2);
    }
    if (is_call(inner, "cos")) return direction(inner.op(0)).cos;
    return is_call(inner, "sin") ? direction(inner.op(0)).sin : inner;
  }

 private:
  struct Direction {
    ex cos, sin;
  };

  static Direction direction(const ex& angle) {
    if (GiNaC::is_a<GiNaC::add>(angle)) {
      Direction sum{1, 0};
      for (const ex& term : angle) {
        const Direction next = direction(term);
        sum = {sum.cos * next.cos - sum.sin * next.sin, sum.sin * next.cos + sum.cos * next.sin};
      }
      return sum;
    }
    if (is_inverse(-angle)) {
      const Direction opposite = direction(-angle);
      return {opposite.cos, -opposite.sin};
    }
    if (is_call(angle, "asin")) return {sqrt(1 - pow(angle.op(0), 2)), angle.op(0)};  // (1)
    if (is_call(angle, "atan2")) {                                                    // (2)
      const ex y = angle.op(0), x = angle.op(1), length = sqrt((x * x + y * y).expand());
      return {x / length, y / length};
    }
    return {GiNaC::cos(angle), GiNaC::sin(angle)};
  }
  static bool is_inverse(const ex& e) { return is_call(e, "asin") || is_call(e, "atan2"); }
  static bool is_call(const ex& e, const char* name) {
    return GiNaC::is_a<GiNaC::function>(e) && GiNaC::ex_to<GiNaC::function>(e).get_name() == name;
  }
};

/// Translates formulas of GiNaC into nodes: magnitudes with separate signs, in canonical order, so that nodes and their
/// roundings are the same in every run.
class Translator {
 public:
  explicit Translator(SeriesProgram& program) : program_(program) {}

  void bind(const GiNaC::symbol& symbol, Node node) { values_[symbol] = {false, node}; }

  Node operator()(const ex& e) {
    const Value value = visit(e);
    return value.negative ? program_.neg(value.magnitude) : value.magnitude;
  }

 private:
  struct Value {
    bool negative = false;
    Node magnitude = -1;
  };

  Value visit(const ex& e) {
    if (const auto known = values_.find(e); known != values_.end()) return known->second;
    const Value value = translate(e);
    values_.emplace(e, value);
    return value;
  }

  Value translate(const ex& e) {
    if (GiNaC::is_a<numeric>(e)) {
      const auto& number = GiNaC::ex_to<numeric>(e);
      return {number.is_negative(), program_.constant(program_.precision().ball(GiNaC::abs(number)))};
    }
    if (e.is_equal(GiNaC::Pi)) return {false, program_.constant(pi())};
    if (GiNaC::is_a<GiNaC::add>(e)) return sum(e);
    if (GiNaC::is_a<GiNaC::mul>(e)) return product(order_.sorted(e));
    if (GiNaC::is_a<GiNaC::power>(e)) return product({e});
    if (GiNaC::is_a<GiNaC::function>(e)) return {false, call(GiNaC::ex_to<GiNaC::function>(e))};
    throw Unsupported(fmt::format("a formula contains {}, which has no value", printed(e)));
  }

  Ball pi() const {
    Ball pi;
    arb_const_pi(pi.get(), program_.precision().bits);
    return pi;
  }

  /// The first term in canonical order is positive in the magnitude.
  Value sum(const ex& e) {
    Value total;
    for (const ex& term : order_.sorted(e)) {
      const Value value = visit(term);
      if (total.magnitude < 0)
        total = value;
      else if (value.negative == total.negative)
        total.magnitude = program_.add(total.magnitude, value.magnitude);
      else
        total.magnitude = program_.sub(total.magnitude, value.magnitude);
    }
    return total;
  }

  /// Numerator over denominator.
  Value product(const std::vector<ex>& factors) {
    bool negative = false;
    Node top = program_.number(1), bottom = top;
    for (const ex& factor : factors) {
      const bool is_power = GiNaC::is_a<GiNaC::power>(factor);
      const bool divides = is_power && factor.op(1).info(GiNaC::info_flags::negative);
      const Value value = is_power ? power(factor.op(0), divides ? ex(-factor.op(1)) : factor.op(1)) : visit(factor);
      negative = negative != value.negative;
      Node& side = divides ? bottom : top;
      side = program_.mul(side, value.magnitude);
    }
    return {negative, program_.div(top, bottom)};
  }

  /// base^exponent, the exponent not a negative number: whole and half powers by multiplication and square root.
  Value power(const ex& base, const ex& exponent) {
    if (GiNaC::is_a<numeric>(exponent)) {
      const numeric twice = 2 * GiNaC::ex_to<numeric>(exponent);
      if (twice.is_integer() && twice < 200) {
        const int n = twice.to_int();
        const Value value = visit(base);
        const Node whole = whole_power(value.magnitude, n / 2);
        return {n % 4 >= 2 && value.negative, n % 2 ? program_.mul(whole, program_.sqrt((*this)(base))) : whole};
      }
    }
    return {false, program_.exp(program_.mul((*this)(exponent), program_.log((*this)(base))))};
  }

  Node whole_power(Node base, int n) {
    if (n == 0) return program_.number(1);
    const Node half = whole_power(base, n / 2), square = program_.mul(half, half);
    return n % 2 ? program_.mul(square, base) : square;
  }

  Node call(const GiNaC::function& f) {
    const std::string name = f.get_name();
    if (name == "magnitude" || name == "abs" || name == "sign" || name == "csgn" || name == "choose")
      throw Bends(fmt::format("a formula bends or jumps: {}", name));
    const Node x = (*this)(f.op(0));
    auto& p = program_;
    if (name == "sin") return p.sin(x);
    if (name == "cos") return p.cos(x);
    if (name == "tan") return p.div(p.sin(x), p.cos(x));
    if (name == "exp") return p.exp(x);
    if (name == "log") return p.log(x);
    if (name == "atan") return p.atan(x);
    if (name == "asin") return p.asin(x);
    if (name == "acos") return p.sub(p.div(p.constant(pi()), p.number(2)), p.asin(x));
    if (name == "atan2") return atan2(x, (*this)(f.op(1)));
    if (name == "sinh" || name == "cosh" || name == "tanh") return hyperbolic(name, x);
    throw Unsupported(fmt::format("a formula contains {}, which has no series here", name));
  }

  /// 2 atan(y / (sqrt(x^2 + y^2) + x)), which is smooth except where y = 0, x <= 0.
  Node atan2(Node y, Node x) {
    auto& p = program_;
    const Node length = p.sqrt(p.add(p.mul(x, x), p.mul(y, y)));
    return p.mul(p.number(2), p.atan(p.div(y, p.add(length, x))));
  }

  Node hyperbolic(const std::string& name, Node x) {
    auto& p = program_;
    const Node grows = p.exp(x), falls = p.div(p.number(1), grows);
    const Node twice_sinh = p.sub(grows, falls), twice_cosh = p.add(grows, falls);
    if (name == "tanh") return p.div(twice_sinh, twice_cosh);
    return p.div(name == "sinh" ? twice_sinh : twice_cosh, p.number(2));
  }

  /// A name that is the same in every run: the node of a symbol, since GiNaC numbers symbols without a name.
  std::string lasting_name(const ex& e) const {
    const auto bound = values_.find(e);
    const bool is_bound = GiNaC::is_a<GiNaC::symbol>(e) && bound != values_.end();
    return is_bound ? fmt::format("node {}", bound->second.magnitude) : printed(e);
  }

  SeriesProgram& program_;
  std::map<ex, Value, GiNaC::ex_is_less> values_;
  CanonicalOrder order_{[this](const ex& e) { return lasting_name(e); }};
};

/// Reads a scene: exact formulas first, nodes next.
class SceneTranslation {
 public:
  SceneTranslation(const Problem& problem, Reading reading, SeriesProgram& program, bool parameters_vary)
      : problem_(problem),
        reading_(reading),
        exact_(reading),
        model_(with_elements(*problem.formulas())),
        program_(program),
        translate_(program) {
    for (std::size_t k = 0; k < model_.parameters.size(); ++k) {
      const ParameterInfo& parameter = model_.parameters[k];
      const ex* const exact = reading == Reading::decimal ? model_.exact_value(parameter) : nullptr;
      parameters_[model_.parameter_symbols[k]] = exact ? exact_(*exact) : ex(as_read(parameter.value, reading));
    }
    if (!parameters_vary) return;
    for (const auto& symbol : model_.parameter_symbols) scene_.values.push_back(number(symbol));
    parameters_vary_ = true;
    for (std::size_t k = 0; k < scene_.values.size(); ++k) {
      program_.set(add(scene_.parameters, program_.state()), 0, scene_.values[k].get());
      translate_.bind(model_.parameter_symbols[k], scene_.parameters[k]);
    }
  }

  SceneFormulas run() {
    scene_.n = static_cast<int>(model_.q.size());
    scene_.n_bodies = scene_.n - problem_.info().n_friction_elements;
    for (const auto& q : model_.q) translate_.bind(q, add(scene_.q, program_.state()));
    for (const auto& v : model_.v) translate_.bind(v, add(scene_.v, program_.state()));
    scene_.clock = program_.state();
    translate_.bind(model_.t, scene_.clock);
    read_start();
    read_dynamics();
    for (const auto& contact : model_.contacts) read_contact(contact);
    if (!model_.region.empty()) read_region();
    return std::move(scene_);
  }

  /// As SceneFormulas::stays_zero.
  bool stays_zero(int i, int variable, bool with_v_n, bool with_v_t) const {
    const int n = scene_.n;
    GiNaC::exmap start = start_, values = parameters_;
    if (variable < 2 * n)
      start.erase(variable < n ? model_.q[variable] : model_.v[variable - n]);
    else
      values.erase(model_.parameter_symbols[variable - 2 * n]);
    const auto& rates = rates_[i];
    for (std::size_t k = 0; k < rates.size(); ++k) {
      const bool is_asked = k == 0 || (k == 1 ? with_v_n : with_v_t);
      if (is_asked && !is_zero_at(rates[k], start, values)) return false;
    }
    return true;
  }

  ContactPair compare(int i, int j) {
    const auto &a = model_.contacts[i], &b = model_.contacts[j];
    return {translate_(exact(a.gap - b.gap).expand()), exact(a.eps_r - b.eps_r).expand().is_zero()};
  }

 private:
  /// The scene with its friction elements. Numbers are exact before jumps of the force are compared. The contacts are
  /// those of the problem, or there is no proof.
  SymbolicModel with_elements(SymbolicModel model) {
    for (ex& f : model.force) f = exact_(f);
    model = with_friction_coordinates(with_jumps_as_friction(with_rolling_friction(std::move(model))));
    if (std::ssize(model.contacts) != problem_.n_c())
      throw Unsupported("a jump of the force is dry friction by its rounded numbers only, or by its exact ones only");
    return model;
  }
  static Node add(std::vector<Node>& list, Node node) {
    list.push_back(node);
    return node;
  }
  ex exact(const ex& e) {
    const ex read = exact_(e);
    return parameters_vary_ ? read : read.subs(parameters_, GiNaC::subs_options::no_pattern);
  }
  Node node(const ex& e) { return translate_(exact(e)); }
  Ball number(const ex& e) {
    const Node n = node(e);
    if (!parameters_vary_ && !program_.is_constant(n)) throw Unsupported("a number of the scene depends on the motion");
    return program_.value_of(n);
  }

  /// q0, v0 and T. Those of the problem hold where they have replaced the formulas.
  void read_start() {
    const ProblemInfo& info = problem_.info();
    const auto read = [&](const SymbolicModel::Expressions& stated, const std::vector<GiNaC::symbol>& symbols,
                          const Vector& current, const Vector& before) {
      for (std::size_t k = 0; k < stated.size(); ++k) {
        const double value = current[static_cast<Eigen::Index>(k)];
        const bool is_stated = before[static_cast<Eigen::Index>(k)] == value;
        const ex start = is_stated ? exact(stated[k]) : ex(as_read(value, reading_));
        start_[symbols[k]] = start;
        scene_.start.push_back(number(start));
        scene_.start_formulas.push_back(node(start));
      }
    };
    read(model_.q0, model_.q, info.q0, problem_.stated_q0());
    read(model_.v0, model_.v, info.v0, problem_.stated_v0());
    start_[model_.t] = 0;
    const ex end_time =
        model_.number(model_.end_time) == info.end_time ? model_.end_time : ex(as_read(info.end_time, reading_));
    scene_.end_time = number(end_time);
    scene_.end_time_formula = node(end_time);
  }

  void read_dynamics() {
    for (const auto& row : model_.mass) {
      scene_.M.emplace_back();
      for (const ex& entry : row) scene_.M.back().push_back(node(entry));
    }
    for (std::size_t i = 0; i < model_.force.size(); ++i) scene_.f.push_back(node(total_force(i)));
  }

  ex total_force(std::size_t i) const {
    ex total = model_.force[i];
    for (std::size_t k = 0; !model_.input.empty() && k < model_.control.size(); ++k)
      total += model_.input[i][k] * model_.control[k];
    return total;
  }

  /// Whether a formula of q, v and t is zero at the start, by the rules of algebra. A denominator that is zero needs no
  /// care: the formula has no value in balls then, and nothing is proven of its motion.
  bool is_zero_at_start(const ex& e) const { return !parameters_vary_ && is_zero_at(e, start_, {}); }

  /// The same with some `values` of parameters.
  static bool is_zero_at(const ex& e, const GiNaC::exmap& start, const GiNaC::exmap& values) {
    try {
      const ex value = e.subs(start, GiNaC::subs_options::no_pattern).subs(values, GiNaC::subs_options::no_pattern);
      if (value.is_zero() || value.expand().is_zero()) return true;
      AngleRules rules;
      const ex simpler = rules(rules(value).expand()).expand();
      return simpler.is_zero() || simpler.normal().numer().expand().is_zero();
    } catch (const std::exception&) {  // a division by zero
      return false;
    }
  }

  /// Whether mu^2 lambda_n^2 = lambda_t^2 holds exactly for M a - J' lambda = f, J a + dJ/dt v = 0 at the start, where
  /// `rates` are v_n and v_t. @returns false if a number is not rational
  bool is_at_limit(const ex& mu, const std::vector<ex>& rates) {
    const auto n = static_cast<unsigned>(model_.q.size()), m = static_cast<unsigned>(rates.size());
    GiNaC::matrix A(n + m, n + m), right(n + m, 1), unknowns(n + m, 1);
    bool is_rational = true;
    const auto at_start = [&](const ex& e) {
      const ex value = exact(e).subs(start_, GiNaC::subs_options::no_pattern);
      is_rational = is_rational && value.info(GiNaC::info_flags::rational);
      return value;
    };
    try {
      for (unsigned i = 0; i < n; ++i) {
        for (unsigned k = 0; k < n; ++k) A(i, k) = at_start(model_.mass[i][k]);
        right(i, 0) = at_start(total_force(i));
      }
      for (unsigned j = 0; j < m; ++j) {
        ex bias = rates[j].diff(model_.t);
        for (unsigned k = 0; k < n; ++k) {
          bias += rates[j].diff(model_.q[k]) * model_.v[k];
          A(n + j, k) = at_start(rates[j].diff(model_.v[k]));
          A(k, n + j) = -A(n + j, k);
        }
        right(n + j, 0) = at_start(-bias);
      }
      for (unsigned i = 0; i < n + m; ++i) unknowns(i, 0) = GiNaC::symbol();
      if (!is_rational) return false;
      const GiNaC::matrix solution = A.solve(unknowns, right);
      ex excess = GiNaC::pow(mu * solution(n, 0), 2);
      for (unsigned j = 1; j < m; ++j) excess -= GiNaC::pow(solution(n + j, 0), 2);
      return excess.info(GiNaC::info_flags::rational) && excess.is_zero();
    } catch (const std::exception&) {  // a division by zero, or a singular system
      return false;
    }
  }

  /// An entry of a direction or a drive with (2) of problems/derivatives/varying_friction.h. The square of a root has no
  /// value where mu is not positive, so that nothing is proven there.
  Node scaled(const SymbolicModel::Contact& stated, Node entry) {
    if (!stated.mu_varies) return entry;
    const Node root = program_.sqrt(node(stated.mu));
    return program_.mul(program_.mul(root, root), entry);
  }

  void read_contact(const SymbolicModel::Contact& stated) {
    ContactFormulas contact;
    contact.name = stated.name;
    contact.is_bilateral = stated.is_bilateral;
    contact.is_friction_element = stated.is_friction_element;
    contact.mu_varies = stated.mu_varies;
    if (stated.eps_r.has(model_.v_n))
      throw Unsupported(fmt::format("the restitution of '{}' depends on the approach speed", stated.name));
    if (model_.number(stated.mu_static) != 0)
      throw Unsupported(fmt::format("'{}' has another coefficient of friction while it sticks", stated.name));
    const ex mu = stated.mu_varies ? ex(1) : stated.mu;
    contact.eps_r = number(stated.eps_r);
    contact.mu = number(mu);
    contact.eps_r_formula = node(stated.eps_r);
    contact.mu_formula = node(mu);
    const ex gap = exact(stated.gap);
    contact.gap = translate_(gap);
    ex v_n = gap.diff(model_.t);
    for (std::size_t k = 0; k < model_.q.size(); ++k) {
      contact.J_n.push_back(program_.derivative(contact.gap, scene_.q[k]));
      v_n += gap.diff(model_.q[k]) * model_.v[k];
    }
    read_opposite_slopes(gap, contact);
    contact.v_n = program_.add(program_.dot(contact.J_n, scene_.v), program_.derivative(contact.gap, scene_.clock));
    contact.gap_is_zero = is_zero_at_start(gap);
    contact.v_n_is_zero = is_zero_at_start(v_n);
    contact.v_t_is_zero = true;
    std::vector<ex> rates{v_n};
    for (std::size_t d = 0; !contact.mu.is_zero() && d < stated.tangents.size(); ++d) {
      ex v_t = stated.drives.empty() ? ex(0) : exact(stated.drives[d]);
      std::vector<Node> direction;
      Node slip = scaled(stated, translate_(v_t));
      for (std::size_t k = 0; k < model_.q.size(); ++k) {
        const ex entry = exact(stated.tangents[d][k]);
        direction.push_back(scaled(stated, translate_(entry)));
        v_t += entry * model_.v[k];
      }
      if (stated.mu_varies) v_t *= exact(stated.mu);
      slip = program_.add(program_.dot(direction, scene_.v), slip);
      contact.J_t.push_back(direction);
      contact.v_t.push_back(slip);
      contact.v_t_is_zero = contact.v_t_is_zero && is_zero_at_start(v_t);
      rates.push_back(v_t);
    }
    const bool is_at_rest = contact.gap_is_zero && contact.v_n_is_zero && contact.v_t_is_zero;
    contact.sticks_at_limit = contact.n_t() == 2 && is_at_rest && is_at_limit(exact(mu), rates);
    rates.insert(rates.begin(), gap);
    rates_.push_back(std::move(rates));
    scene_.contacts.push_back(std::move(contact));
  }

  void read_region() {
    if (has_levers(problem_.info()))  // whose theta has another symbol in every region
      throw Unsupported("formulas bend or jump, and friction is bounded by the force of a contact");
    const auto has_one = [](const ex& e, const std::vector<GiNaC::symbol>& symbols) {
      return std::ranges::any_of(symbols, [&](const auto& symbol) { return e.has(symbol); });
    };
    const auto formulas = std::make_shared<RegionFormulas>();
    for (std::size_t k = 0; k < model_.region.size(); ++k) {
      const ex psi = exact(model_.switching[k]);
      formulas->functions.push_back(psi);
      scene_.borders.push_back({.formula = printed(model_.switching[k]),
                                .function = translate_(model_.region[k] * psi),
                                .is_zero = is_zero_at_start(psi),
                                .has_place = has_one(psi, model_.q),
                                .has_speed = has_one(psi, model_.v)});
    }
    for (const auto& row : model_.mass) {
      for (const ex& entry : row) formulas->mass.push_back(exact(entry));
    }
    for (const auto& stated : model_.contacts) {
      // The gap of a friction element is its coordinate, for which every region has a symbol of its own.
      RegionFormulas::Contact contact{
          stated.is_friction_element ? ex(0) : exact(stated.gap), {}, stated.mu_varies ? exact(stated.mu) : ex(1)};
      for (const auto& direction : stated.tangents) {
        for (const ex& entry : direction) contact.directions.push_back(exact(entry));
      }
      for (const ex& drive : stated.drives) contact.directions.push_back(exact(drive));
      formulas->contacts.push_back(std::move(contact));
    }
    scene_.region = formulas;
  }

  void read_opposite_slopes(const ex& gap, ContactFormulas& contact) const {
    std::vector<int> support;
    for (int k = 0; k < scene_.n; ++k) {
      if (!program_.is_zero(contact.J_n[k])) support.push_back(k);
    }
    for (const int k : support) {
      for (const int l : support) {
        if (k < l && ex(gap.diff(model_.q[k]) + gap.diff(model_.q[l])).expand().is_zero())
          contact.opposite_slopes.emplace_back(k, l);
      }
    }
  }

  const Problem& problem_;
  Reading reading_;
  ExactNumbers exact_;
  SymbolicModel model_;
  SeriesProgram& program_;
  Translator translate_;
  GiNaC::exmap parameters_, start_;
  bool parameters_vary_ = false;
  std::vector<std::vector<ex>> rates_;  ///< gap, v_n and v_t of the contacts
  SceneFormulas scene_;
};

}  // namespace

SceneFormulas scene_formulas(const Problem& problem, Reading reading, SeriesProgram& program, bool parameters_vary) {
  if (!is_small(problem))
    throw Unsupported(fmt::format("{} coordinates and {} contacts are too many", problem.n_q(), problem.n_c()));
  if (!problem.formulas()) throw Unsupported("the scene is not made of formulas");
  if (problem.info().impact_law.hypothesis != ImpactHypothesis::newton)
    throw Unsupported(fmt::format("impact law {}", name_of(problem.info().impact_law.hypothesis)));
  const auto translation = std::make_shared<SceneTranslation>(problem, reading, program, parameters_vary);
  SceneFormulas scene = translation->run();
  scene.compare = [translation](int i, int j) { return translation->compare(i, j); };
  scene.stays_zero = [translation](int contact, int variable, bool with_v_n, bool with_v_t) {
    return translation->stays_zero(contact, variable, with_v_n, with_v_t);
  };
  return scene;
}

RegionChange change_between(const SceneFormulas& one, const SceneFormulas& other, int border) {
  const RegionFormulas &a = *one.region, &b = *other.region;
  const auto differ = [](const ex& e, const ex& f) { return !(e - f).expand().is_zero(); };
  const auto are_same = [&](const std::vector<ex>& x, const std::vector<ex>& y) {
    return std::ranges::equal(x, y, std::not_fn(differ));
  };
  // e - f = p psi_k^m, where p has no denominator, is zero where psi_k is, and so is its gradient if m > 1.
  const auto are_same_to = [&](int m, const ex& e, const ex& f) {
    if (!differ(e, f)) return true;
    if (border < 0) return false;
    const ex ratio = ((e - f) / pow(a.functions[static_cast<std::size_t>(border)], m)).normal();
    return GiNaC::is_a<numeric>(ratio.denom());
  };
  RegionChange change;
  change.same_mass_everywhere = are_same(a.mass, b.mass);
  for (std::size_t i = 0; i < a.contacts.size(); ++i) {
    const RegionFormulas::Contact &x = a.contacts[i], &y = b.contacts[i];
    RegionChange::OfContact contact;
    contact.same_everywhere = !differ(x.gap, y.gap) && are_same(x.directions, y.directions) && !differ(x.mu, y.mu);
    contact.same_gap = are_same_to(1, x.gap, y.gap);
    contact.same_slope = are_same_to(2, x.gap, y.gap);
    contact.same_directions =
        std::ranges::equal(x.directions, y.directions, [&](const ex& e, const ex& f) { return are_same_to(1, e, f); });
    change.contacts.push_back(contact);
  }
  return change;
}

}  // namespace ricochet::reference::certified
