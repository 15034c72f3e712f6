// The entry of libFuzzer for the target RICOCHET_FUZZ_TARGET of targets.h.
#include <cstddef>
#include <cstdint>

#include "tests/fuzzers/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ricochet::fuzzing::RICOCHET_FUZZ_TARGET(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
