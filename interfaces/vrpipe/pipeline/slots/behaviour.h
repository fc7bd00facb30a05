#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <vrpipe/component/error.h>
#include <vrpipe/component/statistic.h>
#include <vrpipe/pipeline/counts.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

struct Framebuffer;

/// How fast a unit works: what its timing model asks for.
struct Throughput {
  std::uint32_t items_per_cycle = 1;  ///< peak rate
  std::uint32_t latency_cycles = 1;   ///< from the last item in to the first item out
};

/// A slot's class declares the counters that reports and the checks of conservation need; every unit of the slot counts
/// them. Others are its own.
class Behaviour : public StatisticSet {
 public:
  virtual ~Behaviour() = default;
  /// The unit as its author wrote it: itself, or what stands behind the checks (checked_behaviours.h).
  virtual const Behaviour& unit() const { return *this; }
  /// Before anything is drawn, of a unit that draws into surfaces of the frame or reads them.
  virtual void use_surfaces(Framebuffer& /*framebuffer*/) {}
  /// Holds from now on what another one holds, which is of the same make and parameters, and whose frame is gone on with here: what
  /// some thousand quads do not bring about by themselves, as the tags of a large cache or Hi-Z. Nothing is counted.
  virtual void hold_as(const Behaviour& /*other*/) {}
  /// Adds what it counts to the counts of the frame, or to those of a draw: `of` takes that from a counter.
  virtual void add_to(Counts& /*counts*/, const CountOf& /*of*/) const {}
  /// Called when the frame has ended: what can be checked only then.
  virtual void check_end() {}
  Behaviour& unit() { return const_cast<Behaviour&>(static_cast<const Behaviour*>(this)->unit()); }
};

/// Puts a unit of a slot behind checks of all that it returns (checked_behaviours.h). `name` is SLOT=IMPLEMENTATION.
/// Throws SimulationFault for a unit of another slot.
using SlotCheck = std::unique_ptr<Behaviour> (*)(const std::string& name, const RenderContext& context,
                                                 std::unique_ptr<Behaviour> behaviour);

/// Hands a functional model to a timing model that needs the interface of its slot.
template <class SlotBehaviour>
std::unique_ptr<SlotBehaviour> behaviour_as(std::unique_ptr<Behaviour> behaviour) {
  auto* const typed = dynamic_cast<SlotBehaviour*>(behaviour.get());
  if (typed == nullptr) throw SimulationFault("registry", 0, "a behaviour was made for another slot");
  static_cast<void>(behaviour.release());
  return std::unique_ptr<SlotBehaviour>(typed);
}

}  // namespace vrpipe
