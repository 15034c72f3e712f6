// Simulates a scene and prints its events.
#include <ricochet/ricochet.h>

#include <iostream>

int main() {
  const auto problem = ricochet::make_problem("two_balls_spring", {{"k", 200}});
  const auto method = ricochet::make_method("fesd:gauss:4,elements=as_needed");
  const auto solution = method->solve(*problem, {.steps = 50});
  for (const auto& event : solution.events) std::cout << event.t << " s: " << to_string(event.kind) << "\n";
  std::cout << "q(T) = " << solution.q.transpose() << "\n";
  return solution.succeeded() ? 0 : 1;
}
