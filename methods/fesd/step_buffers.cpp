#include "methods/fesd/step_buffers.h"

#include <algorithm>
#include <utility>

namespace ricochet {

StepBuffers::StepBuffers(const Problem& problem, int n_s, int n_elements) : problem_(problem), n_s_(n_s) {
  previous_->resize(problem, n_s, n_elements);
  make_room(n_elements);
}

void StepBuffers::make_room(int n_elements) {
  if (n_elements <= static_cast<int>(step_->elements.size())) return;
  step_->resize(problem_, n_s_, n_elements);
  const std::size_t before = starts_.size();
  starts_.resize(std::max(before, static_cast<std::size_t>(n_elements)));
  for (std::size_t k = before; k < starts_.size(); ++k) starts_[k].reserve(problem_.info());
}

void StepBuffers::restart(const Vector& q, const Vector& v) {
  step_->n_elements = previous_->n_elements = 0;
  for (FesdStep& step : buffers_) {
    for (Element& element : step.elements) element.forget_guess();
  }
  step_->elements[0].q0 = q;
  step_->v_minus.col(0) = v;
}

void StepBuffers::begin_step(double H, int n_elements) {
  if (step_->n_elements > 0) {
    std::swap(step_, previous_);
    make_room(n_elements);
    step_->elements[0].q0 = previous_->last().q1;
    step_->v_minus.col(0) = previous_->last().v1;
  }
  step_->H = H;
  step_->touches = false;
}

const Element* StepBuffers::left_of(int element) const {
  if (element > 0) return &this->element(element - 1);
  return previous() ? &previous_->last() : nullptr;
}

Switch StepBuffers::switch_before(int element) const {
  if (element > 0) return step_->ends[static_cast<std::size_t>(element) - 1];
  return previous() ? previous_->ends[static_cast<std::size_t>(previous_->n_elements) - 1] : Switch{};
}

}  // namespace ricochet
