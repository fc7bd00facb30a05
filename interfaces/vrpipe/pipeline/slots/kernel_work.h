#pragma once

#include <cstdint>
#include <optional>

namespace vrpipe {

/// What a compute kernel takes of a GPU. Slots `preparation`, `binning` and `render` are kernels by which a frame is prepared
/// or rendered in software; they have no ports and are in no netlist, but take the time of the platform's SM array and
/// the bandwidth of its memory, one kernel after the other (<vrpipe/platforms/software.h>).
struct KernelWork {
  const char* name;
  std::uint64_t items = 0;  ///< Gaussians, splats or pairs
  /// Of all items, on one SM that issues four warp instructions a cycle; an array divides it among what it has.
  double sm_cycles = 0;
  std::uint64_t bytes = 0;                       ///< read from memory and written to it
  double launch_microseconds = 0;                ///< of launching its grids, whatever the array
  std::optional<double> warp_instructions = {};  ///< of all items; none: nobody knows, nor what they spend
};

}  // namespace vrpipe
