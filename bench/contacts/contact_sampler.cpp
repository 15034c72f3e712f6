#include "bench/contacts/contact_sampler.h"

#include <fmt/format.h>

#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/registry.h"
#include "methods/time_stepping/common/time_stepping_method.h"
#include "problems/input_error.h"

namespace ricochet {

void ContactSampler::before(std::int64_t step, const ContactProblem& problem, const Vector& guess) {
  is_recording_ = seen_++ % every_ == 0;
  if (!is_recording_) return;
  if (static_cast<int>(kept_.size()) == 2 * most_) {
    for (std::size_t k = 0; 2 * k < kept_.size(); ++k) {
      if (k > 0) kept_[k] = std::move(kept_[2 * k]);
    }
    kept_.resize(kept_.size() / 2);
    every_ *= 2;
    is_recording_ = (seen_ - 1) % every_ == 0;
    if (!is_recording_) return;
  }
  kept_.push_back({.problem = problem, .title = fmt::format("{}, step {}", run_, step + 1)});
  kept_.back().problem.b.conservativeResize(problem.G.n_rows());
  kept_.back().guess = guess.head(problem.G.n_rows());
}

void ContactSampler::after(const ContactProblem& problem, const Vector& r, ContactStatus status) {
  if (is_recording_ && status == ContactStatus::solved) kept_.back().solution = r.head(problem.G.n_rows());
}

std::vector<StoredContactProblem> ContactSampler::take() const {
  const std::size_t n = kept_.size(), most = std::min<std::size_t>(n, most_);
  std::vector<StoredContactProblem> problems;
  for (std::size_t k = 0; k < most; ++k) problems.push_back(kept_[k * n / most]);
  return problems;
}

std::string SampledScene::name() const {
  std::string text = id;
  for (const auto& [parameter, value] : changes) text += fmt::format(" {}={}", parameter, value);
  return text;
}

std::vector<SampledScene> sampled_scenes() {
  std::vector<SampledScene> list;
  for (const auto& scene : scenes()) list.push_back({scene.id, {}});
  // Scenes of variable size, in a size with large contact problems.
  for (const auto& [id, n] : {std::pair{"sphere_pile", 30},
                              {"block_column", 16},
                              {"bead_row", 32},
                              {"block_on_feet", 16},
                              {"balls_in_box", 20}})
    list.push_back({id, {{"n", n}}});
  return list;
}

std::vector<StoredContactProblem> sample_scene(const SampledScene& scene, const std::string& method, int steps,
                                               int most) {
  const auto problem = make_problem(scene.id, scene.changes);
  const auto stepping = make_method(method);
  auto* observed = dynamic_cast<TimeSteppingMethod*>(stepping.get());
  if (observed == nullptr) throw InputError("--method", method, "a time-stepping method is required");
  if (problem->info().n_c() == 0 || !stepping->can_run(problem->info()).ok) return {};
  ContactSampler sampler(fmt::format("{}, {}, {} steps", scene.name(), method, steps), most);
  observed->set_contact_observer(&sampler);
  Settings settings;
  settings.steps = steps;
  settings.recording = Recording::final_state;
  stepping->solve(*problem, settings);  // a run that ends early has shown its problems until then
  return sampler.take();
}

std::vector<std::vector<StoredContactProblem>> sample_scenes(
    const std::string& method, int steps, int most, const std::function<void(const std::string&, std::size_t)>& told) {
  std::vector<std::vector<StoredContactProblem>> sets;
  for (const SampledScene& scene : sampled_scenes()) {
    auto problems = sample_scene(scene, method, steps, most);
    if (problems.empty()) continue;
    told(scene.name(), problems.size());
    sets.push_back(std::move(problems));
  }
  return sets;
}

}  // namespace ricochet
