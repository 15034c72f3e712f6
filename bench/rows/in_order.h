#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace ricochet {

/// Does the work [begin, end) in pieces on several threads. Results are processed in the order of the pieces, so that
/// the outcome does not depend on the number of threads. A thread that is far ahead waits.
///
/// @param threads  >= 1, including the calling thread
/// @param make     called by all threads, with the number of the thread and a piece [begin, end)
/// @param take     called by one thread at a time, in the order of the pieces
/// An exception of either ends the work after the pieces that were started, and is rethrown here.
void in_order(int threads, std::int64_t begin, std::int64_t end,
              const std::function<std::string(int thread, std::int64_t begin, std::int64_t end)>& make,
              const std::function<void(std::int64_t end, const std::string& made)>& take);

}  // namespace ricochet
