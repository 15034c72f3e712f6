#pragma once

#include <functional>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_file.h"
#include "methods/contact_laws/contact_observer.h"
#include "problems/registry.h"

namespace ricochet {

/// Keeps contact problems of a run, evenly over all that it has: every k-th, where k doubles whenever there are twice
/// as many as wanted.
class ContactSampler final : public ContactObserver {
 public:
  /// @param run  what the titles begin with; @param most  problems
  ContactSampler(std::string run, int most) : run_(std::move(run)), most_(most) {}

  void before(std::int64_t step, const ContactProblem& problem, const Vector& guess) override;
  void after(const ContactProblem& problem, const Vector& r, ContactStatus status) override;

  /// `most` of them, or what there is.
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

/// All of them, in a fixed order.
std::vector<SampledScene> sampled_scenes();

/// Contact problems of one of them; none where the method does not step it.
/// @param method  of time stepping, `steps` of it; @param most  problems
/// @throws InputError for another method
std::vector<StoredContactProblem> sample_scene(const SampledScene& scene, const std::string& method, int steps,
                                               int most);

/// Of all scenes that have some. @param most  problems per scene
/// @param told  is told each scene, and how many problems of it there are
std::vector<std::vector<StoredContactProblem>> sample_scenes(
    const std::string& method, int steps, int most, const std::function<void(const std::string&, std::size_t)>& told);

}  // namespace ricochet
