#include "methods/external/answers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kTimeRounding = 1e-9;  // of the end time, that a client's last time may be beyond it
const std::set<std::string> kFeatures = {
    "friction_2d", "friction_3d", "friction_elements", "friction_of_place", "restitution_of_speed",
    "bilateral",   "time"};

template <class Value>
Value field(const json& object, const std::string& place, const char* name, const char* required) {
  try {
    return object.at(name).get<Value>();
  } catch (const json::exception&) {
    throw BadAnswer(fmt::format("{}{}: {}; {} is required", place, name,
                                object.contains(name) ? object[name].dump().substr(0, 60) : "missing", required));
  }
}

double number(const json& object, const std::string& place, const char* name, double from, double to) {
  const auto value = field<double>(object, place, name, "a number");
  if (!(value >= from && value <= to))
    throw BadAnswer(fmt::format("{}{}: {}; a number from {} to {} is required", place, name, value, from, to));
  return value;
}

Vector vector(const json& object, const std::string& place, const char* name, int size) {
  const auto values = field<std::vector<double>>(object, place, name, "a list of numbers");
  if (static_cast<int>(values.size()) != size)
    throw BadAnswer(fmt::format("{}{}: {} numbers; {} are required", place, name, values.size(), size));
  for (const double x : values) {
    if (!std::isfinite(x)) throw BadAnswer(fmt::format("{}{}: {} is no finite number", place, name, x));
  }
  return Eigen::Map<const Vector>(values.data(), size);
}

/// One of the texts that to_string() gives these values.
template <class Value>
Value choice(const json& object, const std::string& place, const char* name, std::initializer_list<Value> values) {
  const auto text = field<std::string>(object, place, name, "a text");
  std::vector<std::string> allowed;
  for (const Value value : values) {
    if (text == to_string(value)) return value;
    allowed.emplace_back(to_string(value));
  }
  throw BadAnswer(fmt::format("{}{}: '{}'; one of {} is required", place, name, text, fmt::join(allowed, ", ")));
}

/// The answers of one problem: coordinates of bodies, without those that Ricochet adds (problem.h, (7), (8)).
class AnswerReader {
 public:
  explicit AnswerReader(const Problem& problem) : info_(problem.info()), n_(info_.n_mechanical()) {}

  double time(const json& object, const std::string& place) const {
    return number(object, place, "t", 0, info_.end_time * (1 + kTimeRounding));
  }
  Vector position(const json& object, const std::string& place, double t) const {
    return with_added(vector(object, place, "q", n_), t);
  }
  Vector velocity(const json& object, const std::string& place, const char* name) const {
    return with_added(vector(object, place, name, n_), 1);
  }

  Event event(const json& entry, const std::string& place) const {
    Event e;
    e.t = time(entry, place);
    e.kind = choice(entry, place, "kind",
                    {EventKind::impact, EventKind::detach, EventKind::slip_to_stick, EventKind::stick_to_slip,
                     EventKind::slip_reversal});
    e.contact = static_cast<int>(number(entry, place, "contact", 0, info_.n_c() - 1));
    e.q = position(entry, place, e.t);
    e.v_minus = velocity(entry, place, "v_minus");
    e.v_plus = velocity(entry, place, "v_plus");
    e.Lambda_n = entry.contains("Lambda_n") ? vector(entry, place, "Lambda_n", info_.n_c()) : unknown(info_.n_c());
    e.Lambda_t = unknown(info_.n_lambda_t);
    return e;
  }

  Sample sample(const json& entry, const std::string& place) const {
    Sample s;
    s.t = time(entry, place);
    s.q = position(entry, place, s.t);
    s.v_minus = velocity(entry, place, "v_minus");
    s.v_plus = velocity(entry, place, "v_plus");
    return s;
  }

 private:
  static Vector unknown(int size) { return Vector::Constant(size, std::nan("")); }
  Vector with_added(Vector x, double last) const {
    x.conservativeResizeLike(Vector::Zero(info_.n_q));
    if (info_.clock >= 0) x[info_.clock] = last;
    return x;
  }

  const ProblemInfo& info_;
  const int n_;
};

const json& list_of(const json& answer, const char* name) {
  static const json none = json::array();
  if (!answer.contains(name)) return none;
  if (!answer[name].is_array()) throw BadAnswer(fmt::format("{}: a list is required", name));
  return answer[name];
}

Counters counters_of(const json& answer) {
  Counters c;
  if (!answer.contains("counters")) return c;
  const json& given = answer["counters"];
  if (!given.is_object()) throw BadAnswer("counters: an object is required");
  const std::map<std::string, std::int64_t*> known = {{"steps", &c.steps},
                                                      {"force_evaluations", &c.force_evaluations},
                                                      {"jacobian_evaluations", &c.jacobian_evaluations},
                                                      {"mass_factorizations", &c.mass_factorizations},
                                                      {"matrix_factorizations", &c.matrix_factorizations},
                                                      {"linear_solves", &c.linear_solves},
                                                      {"contact_problems", &c.complementarity_solves},
                                                      {"inner_iterations", &c.inner_iterations},
                                                      {"events", &c.events}};
  for (const auto& [name, value] : given.items()) {
    const auto found = known.find(name);
    if (found == known.end()) throw BadAnswer(fmt::format("counters.{}: there is no such counter", name));
    *found->second = static_cast<std::int64_t>(number(given, "counters.", name.c_str(), 0, 9e15));
  }
  return c;
}

}  // namespace

ClientGreeting greeting_of(const json& answer) {
  ClientGreeting greeting;
  if (const auto version = answer.value("ricochet", json()); version != 1)
    throw BadAnswer(fmt::format("ricochet: {}; 1, the version of the protocol, is required", version.dump()));
  greeting.title = field<std::string>(answer, "", "title", "a text");
  greeting.source = answer.contains("source") ? field<std::string>(answer, "", "source", "a text") : "";
  greeting.order_smooth = number(answer, "", "order_smooth", 0, 100);
  greeting.order_impacts = number(answer, "", "order_impacts", 0, 100);
  greeting.is_adaptive = answer.contains("adaptive") && field<bool>(answer, "", "adaptive", "true or false");
  const auto features = field<std::vector<std::string>>(answer, "", "features", "a list of texts");
  for (const auto& feature : features) {
    if (!kFeatures.contains(feature))
      throw BadAnswer(fmt::format("features: '{}'; {} are known", feature, fmt::join(kFeatures, ", ")));
    greeting.features.insert(feature);
  }
  return greeting;
}

void require_ok(const json& answer) {
  if (field<bool>(answer, "", "ok", "true or false")) return;
  throw BadAnswer("it refuses the scene: " + field<std::string>(answer, "", "reason", "a text"));
}

Solution solution_of(const json& answer, const Problem& problem) {
  const AnswerReader reader(problem);
  Solution s;
  s.status = choice(answer, "", "status",
                    {Status::success, Status::infeasible, Status::inner_solver_failed, Status::step_limit,
                     Status::time_limit, Status::non_finite});
  if (!s.succeeded()) s.message = field<std::string>(answer, "", "message", "the reason, a text,");
  s.t = reader.time(answer, "");
  const double T = problem.info().end_time;
  if (s.succeeded() && std::abs(s.t - T) > kTimeRounding * T)
    throw BadAnswer(fmt::format("t: {}; {}, the end time, is required of a success", s.t, T));
  s.q = reader.position(answer, "", s.t);
  s.v = reader.velocity(answer, "", "v");
  s.own_seconds = number(answer, "", "seconds", 0, HUGE_VAL);
  s.counters = counters_of(answer);
  const json &events = list_of(answer, "events"), &samples = list_of(answer, "samples");
  for (std::size_t k = 0; k < events.size(); ++k)
    s.events.push_back(reader.event(events[k], fmt::format("events[{}].", k)));
  for (std::size_t k = 0; k < samples.size(); ++k)
    s.samples.push_back(reader.sample(samples[k], fmt::format("samples[{}].", k)));
  if (s.counters.events == 0) s.counters.events = static_cast<std::int64_t>(s.events.size());
  return s;
}

}  // namespace ricochet
