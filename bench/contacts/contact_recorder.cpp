#include "bench/contacts/contact_recorder.h"

#include <fmt/format.h>

#include <algorithm>

#include "methods/contact_laws/delassus_matrix.h"

namespace ricochet {

void ContactRecorder::before(std::int64_t step, const ContactProblem& problem, const Vector& guess) {
  is_recording_ = wanted_ ? step == *wanted_ && !found() : problem.contacts.size() > stored_.problem.contacts.size();
  if (!is_recording_) return;
  step_ = step;
  stored_ = {};
  stored_.problem = problem;
  stored_.guess = guess.head(problem.G.n_rows());
}

void ContactRecorder::after(const ContactProblem& problem, const Vector& r, ContactStatus status) {
  if (!is_recording_) return;
  status_ = status;
  if (status == ContactStatus::solved) stored_.solution = r.head(problem.G.n_rows());
}

std::string math_info(const ContactProblem& problem) {
  int contacts[3]{};
  for (const auto& contact : problem.contacts) ++contacts[contact.n_t];
  std::string text;
  const char* const kinds[] = {"without friction", "with friction in the plane", "with friction in space"};
  for (int n_t = 0; n_t < 3; ++n_t) {
    if (contacts[n_t] > 0) text += fmt::format("{}{} contacts {}", text.empty() ? "" : ", ", contacts[n_t], kinds[n_t]);
  }
  const SparseMatrix G = sparse_matrix(problem.G), skew = SparseMatrix(G.transpose()) - G;
  return text +
         fmt::format("; W has {} blocks, ||W - W'|| / ||W|| = {:.1e}", problem.G.n_blocks(), skew.norm() / G.norm());
}

}  // namespace ricochet
