#include <vrpipe/workloads/preprocess_parameters.h>

#include <string>

namespace vrpipe {

PreprocessOptions PreprocessParameters::options() const {
  PreprocessOptions options;
  options.sh_degree = static_cast<int>(static_cast<std::uint32_t>(sh_degree));
  options.depth_key_bits = std::stoi(depth_key_bits.value());
  options.dilation = dilation;
  if (opacity_compensation != 0) options.opacity_compensation = opacity_compensation == 1;
  return options;
}

}  // namespace vrpipe
