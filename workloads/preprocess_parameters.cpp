#include <vrpipe/workloads/preprocess_parameters.h>

#include <string>

namespace vrpipe {

PreprocessOptions PreprocessParameters::options() const {
  PreprocessOptions options;
  options.sh_degree = static_cast<int>(static_cast<std::uint32_t>(sh_degree));
  options.depth_key_bits = std::stoi(depth_key_bits.value());
  return options;
}

}  // namespace vrpipe
