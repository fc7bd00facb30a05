#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Slot `prop`: hands bins to ZROP and on to QRU, and shaded warps to CROP in order.
class PropBehaviour : public Behaviour {
 public:
  enum class Order : std::uint8_t { draw, tile };
  struct TimingParameters {
    std::uint32_t quads_per_cycle;  ///< TC to ZROP to QRU
    Rate color_rate;                ///< of quads to CROP, of this draw's format
    std::uint32_t latency_cycles;
    Order order;
  };
  virtual TimingParameters timing() const = 0;
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct PropWork {
  enum : unsigned { bins, tested, color, empty_warps, late };  ///< `late`: quads to be tested late
  static std::vector<WorkKind> kinds(const PropBehaviour::TimingParameters& timing);
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_prop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
