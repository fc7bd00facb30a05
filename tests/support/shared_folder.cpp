#include "support/shared_folder.h"

#include <cstdlib>

namespace vrpipe::testing {

std::filesystem::path shared_folder() {
  const char* const named = std::getenv("VRPIPE_SHARED");
  return named != nullptr ? named : VRPIPE_SHARED;
}

}  // namespace vrpipe::testing
