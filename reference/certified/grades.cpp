#include <algorithm>

#include "reference/certified/certified_motion.h"

namespace ricochet::reference::certified {

const char* name_of(Grade grade) {
  static const char* const names[] = {"proven", "assumed", "computed", "open"};
  return names[static_cast<int>(grade)];
}

int CertifiedMotion::decimals() const {
  int worst = 999;
  for (const auto* numbers : {&q, &v}) {
    for (const auto& number : *numbers) worst = std::min(worst, number.decimals);
  }
  for (const auto& event : events) worst = std::min(worst, event.time.decimals);
  return worst;
}

}  // namespace ricochet::reference::certified
