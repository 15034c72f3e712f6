#pragma once

#include <vector>

#include "methods/elements/fesd_step.h"
#include "methods/fesd/element_start.h"

namespace ricochet {

/// The step that is being solved, with the left ends of its elements, and the step before it.
class StepBuffers {
 public:
  StepBuffers(const Problem& problem, int n_s, int n_elements);
  StepBuffers(const StepBuffers&) = delete;
  StepBuffers& operator=(const StepBuffers&) = delete;

  /// Makes room for more elements than the step had so far. Not inside a run of elements: references to them move.
  void make_room(int n_elements);
  /// A new run from (q, v): there is no step before.
  void restart(const Vector& q, const Vector& v);
  /// The next step, of length H, where the last one ended; where the last one started, if that has been dropped.
  void begin_step(double H, int n_elements);
  /// Discards the elements of the step; it can begin again.
  void drop() { step_->n_elements = 0; }

  FesdStep& step() { return *step_; }
  const FesdStep& step() const { return *step_; }
  /// Null in the first step of a run.
  const FesdStep* previous() const { return previous_->n_elements > 0 ? previous_ : nullptr; }

  Element& element(int n) { return step_->elements[static_cast<std::size_t>(n)]; }
  const Element& element(int n) const { return step_->elements[static_cast<std::size_t>(n)]; }
  ElementStart& start_of(int n) { return starts_[static_cast<std::size_t>(n)]; }
  const ElementStart& start_of(int n) const { return starts_[static_cast<std::size_t>(n)]; }

  /// The element before, also of the step before; null for the first of a run.
  const Element* left_of(int element) const;
  /// The switch that ended it; its contact is -1 when none did.
  Switch switch_before(int element) const;

 private:
  const Problem& problem_;
  const int n_s_;
  FesdStep buffers_[2];
  FesdStep *step_ = &buffers_[0], *previous_ = &buffers_[1];
  std::vector<ElementStart> starts_;
};

}  // namespace ricochet
