#pragma once

#include <atomic>

#include <vrpipe/platforms/configuration.h>

#include "bound.h"

namespace vrpipe {

/// The behaviours of all units, for the counts after a run.
struct BehaviourList {
  std::vector<std::pair<std::string, const Behaviour*>> of_slot;
};

/// A draw without time: every unit's behaviour in turn, bin by bin. With bounds, each unit's work is counted on the way.
class FunctionalGpu {
 public:
  FunctionalGpu(const Configuration& configuration, ColorSurface& surface, bool with_bounds = false);
  ~FunctionalGpu();
  void run(std::atomic<float>* progress);
  BehaviourList behaviours() const;
  /// One for each GPC, after a run with bounds.
  std::vector<const PhaseBound*> bounds() const;

 private:
  struct Gpc;
  void rasterize(Gpc& gpc);
  void bin_flushed(Gpc& gpc);

  const Configuration& configuration_;
  std::unique_ptr<DrawBehaviour> draw_;
  std::unique_ptr<VpoBehaviour> vpo_;
  std::vector<std::unique_ptr<Gpc>> gpcs_;
  std::vector<QuadBeat> tested_;  ///< the bin in hand, after the test
};

}  // namespace vrpipe
