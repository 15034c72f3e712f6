#pragma once

#include <functional>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_file.h"
#include "methods/contact_laws/contact_observer.h"
#include "problems/registry.h"

namespace ricochet {

/// Records contact problems of a run, evenly distributed over the run: every k-th one, where k doubles whenever twice
/// as many as required are stored.
class ContactSampler final : public ContactObserver {
 public:
  /// @param run  prefix of the titles; @param most  maximum number of problems
  ContactSampler(std::string run, int most) : run_(std::move(run)), most_(most) {}

  void before(std::int64_t step, const ContactProblem& problem, const Vector& guess) override;
  void after(const ContactProblem& problem, const Vector& r, ContactStatus status) override;

  /// Up to `most` problems.
  std::vector<StoredContactProblem> take() const;

 private:
  std::string run_;
  int most_;
  std::int64_t seen_ = 0, every_ = 1;
  bool is_recording_ = false;
  std::vector<StoredContactProblem> kept_;
};

/// A compiled scene, in its usual size or with more bodies.
struct SampledScene {
  std::string id;
  ParameterChanges changes;

  std::string name() const;  ///< "bead_row n=32"
};

/// All sampled scenes, in a fixed order.
std::vector<SampledScene> sampled_scenes();

/// Contact problems of one scene; none if the method declines it.
/// @param method  time-stepping method; @param most  maximum number of problems
/// @throws InputError for another method
std::vector<StoredContactProblem> sample_scene(const SampledScene& scene, const std::string& method, int steps,
                                               int most);

/// Contact problems of all scenes that have some. @param most  maximum number per scene
/// @param told  called with each scene and its number of problems
std::vector<std::vector<StoredContactProblem>> sample_scenes(
    const std::string& method, int steps, int most, const std::function<void(const std::string&, std::size_t)>& told);

}  // namespace ricochet
