#include "methods/external/external_client.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "methods/external/answers.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_writer.h"
#include "problems/vector_json.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr int kVersion = 1;          // of the protocol
constexpr double kStart = 60;        // [s] for a client to start, and to read a scene
constexpr double kGrace = 1;         // [s] beyond the time limit, for a client that keeps it by itself
constexpr std::size_t kShown = 200;  // characters of an answer that a message shows

const char* name_of(Recording recording) {
  switch (recording) {
    case Recording::final_state:
      return "final_state";
    case Recording::events:
      return "events";
    case Recording::grid:
    case Recording::motion:  // no client tells the motion between its steps
      break;
  }
  return "grid";
}

}  // namespace

std::shared_ptr<ExternalClient> ExternalClient::of(const std::string& command) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<ExternalClient>> clients;
  const std::lock_guard lock(mutex);
  auto& client = clients[command];
  if (!client) client = std::make_shared<ExternalClient>(command);
  return client;
}

/// @throws ClientFailure
json ExternalClient::ask(json question, double limit) {
  question["id"] = ++last_id_;
  const std::string line = process_.ask(question.dump(), limit);
  const json answer = json::parse(line, nullptr, false);
  if (!answer.is_object() || answer.value("id", json()) != question["id"]) {
    process_.kill();
    throw ClientFailure(Status::inner_solver_failed, fmt::format("its answer is no JSON object with \"id\": {}: {}",
                                                                 last_id_, line.substr(0, kShown)));
  }
  return answer;
}

const ClientGreeting& ExternalClient::greeting() {
  const std::lock_guard lock(mutex_);
  if (greeting_) return *greeting_;
  try {
    const json answer = ask({{"ask", "hello"}, {"ricochet", kVersion}}, kStart);
    greeting_ = std::make_unique<ClientGreeting>(greeting_of(answer));
  } catch (const ClientFailure& failure) {
    throw InputError("external method", "the client", failure.what());
  } catch (const BadAnswer& bad) {
    throw InputError("external method", "the client", bad.what());
  }
  return *greeting_;
}

/// Sends the scene unless the client already has it.
void ExternalClient::send_scene(const Problem& problem, double limit) {
  std::string text = scene_text(problem, {.with_normals = true, .with_set_state = false, .with_until = false});
  if (text == scene_ && process_.starts() == scene_start_) return;
  scene_start_ = -1;
  const json answer = ask({{"ask", "scene"}, {"scene", json::parse(text)}}, limit);
  require_ok(answer);
  scene_ = std::move(text);
  scene_start_ = process_.starts();
}

Solution ExternalClient::solve(const Problem& problem, const Settings& settings, int seed) {
  const ProblemInfo& info = problem.info();
  const int n = info.n_mechanical();
  const std::lock_guard lock(mutex_);
  Solution failed;
  failed.q = info.q0;
  failed.v = info.v0;
  try {
    send_scene(problem, kStart);
    json question = {{"ask", "solve"},     {"q0", Vector(info.q0.head(n))},         {"v0", Vector(info.v0.head(n))},
                     {"T", info.end_time}, {"record", name_of(settings.recording)}, {"seed", seed}};
    if (settings.steps > 0) question["steps"] = settings.steps;
    if (settings.tolerance > 0) question["tolerance"] = settings.tolerance;
    if (settings.time_limit > 0) question["time_limit"] = settings.time_limit;
    return solution_of(ask(question, settings.time_limit > 0 ? settings.time_limit + kGrace : 0), problem);
  } catch (const ClientFailure& failure) {
    failed.status = failure.status;
    failed.message = std::string("the client: ") + failure.what();
  } catch (const BadAnswer& bad) {
    failed.status = Status::inner_solver_failed;
    failed.message = std::string("the client's answer: ") + bad.what();
  }
  return failed;
}

}  // namespace ricochet
