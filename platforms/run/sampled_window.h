#pragma once

#include <cstdint>
#include <future>
#include <optional>

#include "run/frame_progress.h"

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

class UntimedGpu;

/// A window of a frame, simulated on a thread of its own from when it is made. There is one at a time, since SystemC has one
/// simulation at a time in a process; whoever makes it simulates nothing with time until its end.
class SampledWindow {
 public:
  struct Range {
    double from = 0;                  ///< quads that warm it up
    double quads = 0;                 ///< that are measured then
    std::optional<DrawIndex> around;  ///< in place of `from`: half of them are before this draw
    bool to_end = false;              ///< of the frame
  };
  struct Measured {
    double from = 0, to = 0;                               ///< quads since it began to warm up
    std::uint64_t primitives_from = 0, primitives_to = 0;  ///< since then, as the cycles
    double cycle_from = 0, cycle_to = 0;
    double delay_growth = 0;  ///< cycles that its last quads take longer to the end than its first
    std::uint64_t kernel_events = 0;
    bool is_whole = false;  ///< the frame did not end before it
  };

  /// @param request  at `cycle`
  /// @param rest     the frame, gone on with from where it begins to warm up
  /// @param before   has drawn what is before that; what its units and memories hold is copied
  /// @param drawn    by that; it is drawn on
  SampledWindow(const RunRequest& request, const Frame& rest, Range range, const UntimedGpu& before,
                Framebuffer& drawn);
  /// Waits for it. Throws what the simulation throws.
  Measured result() { return measured_.get(); }

 private:
  Measured measure();
  struct FreshSimulation {
    FreshSimulation() { fresh_simulation(); }
    ~FreshSimulation() { fresh_simulation(); }
  };
  const FreshSimulation around_;
  const Range range_;
  const Configuration configuration_;
  Gpu gpu_;
  const FrameProgress progress_;
  std::future<Measured> measured_;  ///< whose end waits for that of the thread
};

}  // namespace vrpipe
