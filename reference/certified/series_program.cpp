#include "reference/certified/series_program.h"

#include <algorithm>

namespace ricochet::reference::certified {

void SeriesProgram::Coefficients::reserve(int n) {
  if (n <= n_) return;
  const arb_ptr grown = _arb_vec_init(n);
  for (int k = 0; k < n_; ++k) arb_swap(grown + k, data_ + k);
  clear();
  data_ = grown;
  n_ = n;
}

void SeriesProgram::Coefficients::clear() {
  if (data_) _arb_vec_clear(data_, n_);
  data_ = nullptr;
  n_ = 0;
}

Node SeriesProgram::append(Op op, Node a, Node b) {
  Entry& x = nodes_.emplace_back();
  x.op = op;
  x.a = a;
  x.b = b;
  x.c.reserve(1);
  return size() - 1;
}

Node SeriesProgram::constant(const Ball& value) {
  if (arb_is_exact(value.get())) {
    for (Node i = 0; i < size(); ++i) {
      if (is_constant(i) && arb_is_exact(nodes_[i].c.at(0)) && arb_equal(nodes_[i].c.at(0), value.get())) return i;
    }
  }
  const Node i = append(Op::constant, -1, -1);
  arb_set(nodes_[i].c.at(0), value.get());
  return i;
}

Node SeriesProgram::number(long value) {
  Ball ball;
  arb_set_si(ball.get(), value);
  return constant(ball);
}

Node SeriesProgram::state() {
  return append(Op::state, -1, -1);
}

bool SeriesProgram::is_zero(Node a) const {
  return is_constant(a) && arb_is_zero(nodes_[a].c.at(0));
}

bool SeriesProgram::is_one(Node a) const {
  return is_constant(a) && arb_is_one(nodes_[a].c.at(0));
}

Node SeriesProgram::fold(Op op, Node a, Node b) {
  const slong bits = precision_.bits;
  const arb_srcptr x = nodes_[a].c.at(0), y = b < 0 ? nullptr : nodes_[b].c.at(0);
  Ball r;
  switch (op) {
    case Op::add:
      arb_add(r.get(), x, y, bits);
      break;
    case Op::sub:
      arb_sub(r.get(), x, y, bits);
      break;
    case Op::mul:
      arb_mul(r.get(), x, y, bits);
      break;
    case Op::div:
      arb_div(r.get(), x, y, bits);
      break;
    case Op::neg:
      arb_neg(r.get(), x);
      break;
    case Op::sqrt:
      arb_sqrt(r.get(), x, bits);
      break;
    case Op::sin:
      arb_sin(r.get(), x, bits);
      break;
    case Op::cos:
      arb_cos(r.get(), x, bits);
      break;
    case Op::exp:
      arb_exp(r.get(), x, bits);
      break;
    case Op::log:
      arb_log(r.get(), x, bits);
      break;
    case Op::atan:
      arb_atan(r.get(), x, bits);
      break;
    case Op::asin:
      arb_asin(r.get(), x, bits);
      break;
    case Op::constant:
    case Op::state:
      break;
  }
  return constant(r);
}

Node SeriesProgram::make(Op op, Node a, Node b) {
  if (is_constant(a) && (b < 0 || is_inverse(op) || is_constant(b))) return fold(op, a, is_inverse(op) ? -1 : b);
  const auto key = std::tuple(op, a, b);
  if (const auto known = known_.find(key); known != known_.end()) return known->second;
  const Node i = append(op, a, b);
  known_.emplace(key, i);
  return i;
}

Node SeriesProgram::add(Node a, Node b) {
  if (is_zero(a)) return b;
  if (is_zero(b)) return a;
  return a < b ? make(Op::add, a, b) : make(Op::add, b, a);
}

Node SeriesProgram::sub(Node a, Node b) {
  if (is_zero(b)) return a;
  if (is_zero(a)) return neg(b);
  return a == b ? number(0) : make(Op::sub, a, b);
}

Node SeriesProgram::mul(Node a, Node b) {
  if (is_zero(a) || is_zero(b)) return number(0);
  if (is_one(a)) return b;
  if (is_one(b)) return a;
  if (is_constant(b) || (!is_constant(a) && a > b)) std::swap(a, b);  // a constant stands first
  return make(Op::mul, a, b);
}

Node SeriesProgram::div(Node a, Node b) {
  return is_zero(a) || is_one(b) ? a : make(Op::div, a, b);
}

Node SeriesProgram::neg(Node a) {
  return nodes_[a].op == Op::neg ? nodes_[a].a : make(Op::neg, a);
}

Node SeriesProgram::sqrt(Node a) {
  return make(Op::sqrt, a);
}

/// Sine and cosine of the same argument are neighbours, each the operand b of the other.
Node SeriesProgram::pair_of_sine(Node a, bool cosine) {
  if (is_constant(a)) return fold(cosine ? Op::cos : Op::sin, a, -1);
  const auto key = std::tuple(Op::sin, a, -1);
  auto known = known_.find(key);
  if (known == known_.end()) {
    const Node s = append(Op::sin, a, -1);
    nodes_[s].b = append(Op::cos, a, s);
    known = known_.emplace(key, s).first;
  }
  return known->second + (cosine ? 1 : 0);
}

Node SeriesProgram::sin(Node a) {
  return pair_of_sine(a, false);
}

Node SeriesProgram::cos(Node a) {
  return pair_of_sine(a, true);
}

Node SeriesProgram::exp(Node a) {
  return make(Op::exp, a);
}

Node SeriesProgram::log(Node a) {
  return make(Op::log, a, a);
}

Node SeriesProgram::atan(Node a) {
  return make(Op::atan, a, add(number(1), mul(a, a)));
}

Node SeriesProgram::asin(Node a) {
  return make(Op::asin, a, sqrt(sub(number(1), mul(a, a))));
}

Node SeriesProgram::dot(const std::vector<Node>& a, const std::vector<Node>& b) {
  Node sum = number(0);
  for (std::size_t i = 0; i < a.size(); ++i) sum = add(sum, mul(a[i], b[i]));
  return sum;
}

Node SeriesProgram::derivative(Node f, Node x) {
  if (f == x) return number(1);
  if (is_constant(f) || nodes_[f].op == Op::state) return number(0);
  if (const auto known = derivatives_.find({f, x}); known != derivatives_.end()) return known->second;
  const Node result = differentiate(f, x);
  derivatives_.emplace(std::pair(f, x), result);
  return result;
}

Node SeriesProgram::differentiate(Node f, Node x) {
  const Op op = nodes_[f].op;
  const Node a = nodes_[f].a, b = nodes_[f].b;
  const Node da = derivative(a, x);
  const auto db = [&] { return derivative(b, x); };
  switch (op) {
    case Op::add:
      return add(da, db());
    case Op::sub:
      return sub(da, db());
    case Op::mul:
      return add(mul(da, b), mul(a, db()));
    case Op::div:
      return div(sub(da, mul(f, db())), b);
    case Op::neg:
      return neg(da);
    case Op::sqrt:
      return div(da, mul(number(2), f));
    case Op::sin:
      return mul(b, da);
    case Op::cos:
      return neg(mul(b, da));
    case Op::exp:
      return mul(f, da);
    case Op::log:
    case Op::atan:
    case Op::asin:
      return div(da, b);
    case Op::constant:
    case Op::state:
      break;
  }
  return number(0);
}

std::vector<Node> SeriesProgram::schedule(const std::vector<Node>& outputs) const {
  std::vector<char> needed(nodes_.size(), 0);
  for (const Node output : outputs) needed[output] = 1;
  for (Node i = size() - 1; i >= 0; --i) {
    const Entry& x = nodes_[i];
    if (!needed[i]) continue;
    if (x.a >= 0) needed[x.a] = 1;
    if (x.b >= 0) needed[x.b] = 1;
  }
  std::vector<Node> result;
  for (Node i = 0; i < size(); ++i) {
    if (needed[i]) result.push_back(i);
  }
  return result;
}

void SeriesProgram::set(Node variable, int k, arb_srcptr value) {
  Entry& x = nodes_[variable];
  x.c.reserve(k == 0 ? 1 : std::max(k + 1, precision_.order + 2));
  arb_set(x.c.at(k), value);
  if (k == 0) x.epoch = epoch_;
}

arb_srcptr SeriesProgram::value(Node i) {
  if (is_constant(i) || nodes_[i].epoch == epoch_) return nodes_[i].c.at(0);
  for (const Node operand : {nodes_[i].a, nodes_[i].b}) {
    if (operand >= 0 && operand < i) value(operand);
  }
  compute(i, 0, precision_.bits);
  return nodes_[i].c.at(0);
}

std::vector<Ball> SeriesProgram::values_of(const std::vector<Node>& nodes) {
  std::vector<Ball> values;
  for (const Node node : nodes) values.push_back(value_of(node));
  return values;
}

std::vector<std::vector<Ball>> SeriesProgram::values_of(const std::vector<std::vector<Node>>& rows) {
  std::vector<std::vector<Ball>> values;
  for (const auto& row : rows) values.push_back(values_of(row));
  return values;
}

int SeriesProgram::leading(Node a, int first, int last) const {
  if (is_constant(a)) return first == 0 && !is_zero(a) ? 0 : last + 1;
  int k = first;
  while (k <= last && arb_is_zero(coefficient(a, k))) ++k;
  return k;
}

void SeriesProgram::compute(Node i, int k, slong bits) {
  Entry& x = nodes_[i];
  if (x.op == Op::constant || x.op == Op::state) return;
  if (k == 0) {
    start(x, bits);
    x.epoch = epoch_;
  } else {
    x.c.reserve(precision_.order + 2);
    if (x.op == Op::sin || x.op == Op::exp || is_inverse(x.op)) x.slopes.reserve(precision_.order + 2);
    advance(x, k, bits);
  }
}

void SeriesProgram::start(Entry& x, slong bits) {
  const arb_ptr c = x.c.at(0);
  const arb_srcptr a = nodes_[x.a].c.at(0), b = x.b >= 0 ? nodes_[x.b].c.at(0) : nullptr;
  switch (x.op) {
    case Op::add:
      arb_add(c, a, b, bits);
      break;
    case Op::sub:
      arb_sub(c, a, b, bits);
      break;
    case Op::mul:
      x.a == x.b ? arb_sqr(c, a, bits) : arb_mul(c, a, b, bits);
      break;
    case Op::div:
      arb_div(c, a, b, bits);
      break;
    case Op::neg:
      arb_neg(c, a);
      break;
    case Op::sqrt:
      arb_sqrt(c, a, bits);
      break;
    case Op::sin:
      arb_sin(c, a, bits);
      break;
    case Op::cos:
      arb_cos(c, a, bits);
      break;
    case Op::exp:
      arb_exp(c, a, bits);
      break;
    case Op::log:
      arb_log(c, a, bits);
      break;
    case Op::atan:
      arb_atan(c, a, bits);
      break;
    case Op::asin:
      arb_asin(c, a, bits);
      break;
    case Op::constant:
    case Op::state:
      break;
  }
}

/// Coefficient k of the constant or function `i`: zero beyond the first for constants.
void SeriesProgram::advance(Entry& x, int k, slong bits) {
  const arb_ptr c = x.c.at(k);
  const bool first_is_constant = is_constant(x.a), second_is_constant = x.b >= 0 && is_constant(x.b);
  static const Ball zero;
  const auto of = [&](Node n) -> arb_srcptr { return is_constant(n) ? zero.get() : nodes_[n].c.at(k); };
  const auto array = [&](Node n) -> arb_srcptr { return nodes_[n].c.at(0); };
  switch (x.op) {
    case Op::add:
      arb_add(c, of(x.a), of(x.b), bits);
      return;
    case Op::sub:
      arb_sub(c, of(x.a), of(x.b), bits);
      return;
    case Op::neg:
      arb_neg(c, of(x.a));
      return;
    case Op::mul:
      if (first_is_constant) {
        arb_mul(c, array(x.a), of(x.b), bits);
      } else {
        arb_dot(c, nullptr, 0, array(x.a), 1, array(x.b) + k, -1, k + 1, bits);
      }
      return;
    case Op::div:
      if (second_is_constant) {
        arb_div(c, of(x.a), array(x.b), bits);
      } else {
        arb_dot(c, of(x.a), 1, x.c.at(0), 1, array(x.b) + k, -1, k, bits);
        arb_div(c, c, array(x.b), bits);
      }
      return;
    case Op::sqrt:
      arb_dot(c, of(x.a), 1, x.c.at(1), 1, x.c.at(k - 1), -1, k - 1, bits);
      arb_div(c, c, x.c.at(0), bits);
      arb_mul_2exp_si(c, c, -1);
      return;
    case Op::sin:
    case Op::cos:
    case Op::exp:
    case Op::log:
    case Op::atan:
    case Op::asin:
      advance_transcendental(x, k, bits);
      return;
    case Op::constant:
    case Op::state:
      return;
  }
}

/// Equations (5) to (7).
void SeriesProgram::advance_transcendental(Entry& x, int k, slong bits) {
  const arb_ptr c = x.c.at(k);
  const arb_srcptr a = nodes_[x.a].c.at(k);
  const auto whole = static_cast<ulong>(k);
  if (x.op == Op::cos) {
    arb_dot(c, nullptr, 1, nodes_[x.b].slopes.at(1), 1, nodes_[x.b].c.at(k - 1), -1, k, bits);
    arb_div_ui(c, c, whole, bits);
  } else if (is_inverse(x.op)) {
    arb_dot(c, nullptr, 1, x.slopes.at(1), 1, nodes_[x.b].c.at(k - 1), -1, k - 1, bits);
    arb_div_ui(c, c, whole, bits);
    arb_add(c, c, a, bits);
    arb_div(c, c, nodes_[x.b].c.at(0), bits);
    arb_mul_ui(x.slopes.at(k), c, whole, bits);
  } else {
    arb_mul_ui(x.slopes.at(k), a, whole, bits);
    const arb_srcptr partner = x.op == Op::sin ? nodes_[x.b].c.at(k - 1) : x.c.at(k - 1);
    arb_dot(c, nullptr, 0, x.slopes.at(1), 1, partner, -1, k, bits);
    arb_div_ui(c, c, whole, bits);
  }
}

}  // namespace ricochet::reference::certified
