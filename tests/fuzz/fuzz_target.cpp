// A libFuzzer target for the format that the build names; see scripts/fuzz-formats.
#include <cstddef>
#include <cstdint>

#include "fuzz/exercise.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  vrpipe::testing::exercise(VRPIPE_FUZZED_FORMAT, data, size);
  return 0;
}
