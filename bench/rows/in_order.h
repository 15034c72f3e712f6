#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace ricochet {

/// Work [begin, end) in pieces, by several threads; what they make of it is taken in its order, whatever the order in
/// which it is finished, so that the outcome does not depend on the number of threads. A thread that is far ahead waits.
///
/// @param threads  >= 1; one works in the thread that calls
/// @param make     called by all threads, with the number of the thread and a piece [begin, end)
/// @param take     called by one thread at a time, in the order of the pieces
/// An exception of either ends the work behind the pieces that are begun, and is thrown again here.
void in_order(int threads, std::int64_t begin, std::int64_t end,
              const std::function<std::string(int thread, std::int64_t begin, std::int64_t end)>& make,
              const std::function<void(std::int64_t end, const std::string& made)>& take);

}  // namespace ricochet
