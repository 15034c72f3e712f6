#pragma once

#include "reports/results.h"

namespace ricochet {

/// What a results file makes of a row.
template <class Row>
Row round_trip(const Row& row) {
  return parse_line(line_of(row).dump()).template get<Row>();
}

/// Equal as text, in which NaN is equal to itself.
#define EXPECT_SURVIVES(row) EXPECT_EQ(line_of(round_trip(row)).dump(), line_of(row).dump())

}  // namespace ricochet
