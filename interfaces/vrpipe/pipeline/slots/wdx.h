#pragma once

#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/slots/behaviour.h>
#include <vrpipe/pipeline/tile_owners.h>

namespace vrpipe {

/// Slot `wdx`: the work distribution crossbar, which takes each primitive from the GPC that assembled it to those that
/// own screen tiles of its bounding box. It says who owns what; a platform of one GPC has none.
class WdxBehaviour : public Behaviour {
 public:
  struct Timing {
    std::uint32_t primitives_per_cycle;  ///< of a GPC, in and out
    std::uint32_t latency_cycles;        ///< at least 2
    std::uint32_t credits;               ///< primitives from one GPC to another that may wait for their turn
  };
  /// The GPC of a screen tile of the frame. Depends on the tile alone.
  virtual unsigned owner_of(TileId tile) const = 0;
  virtual Timing timing() const = 0;

  Counter primitives{*this, "primitives", "triangles", "taken from the GPCs that assembled them"};
  Counter copies{*this, "copies", "triangles", "handed to the GPCs that own tiles of their bounds, one for each"};
};

/// The GPCs that an item goes to: with marks, and the ends of batches, all.
inline GpcSet receivers_of(const PrimitiveItem& item, const TileOwners& owners) {
  const bool is_primitive = item.mark == Mark::none && !item.ends_batch;
  return is_primitive ? owners.owners_in(item.primitive.bounds) : ~GpcSet();
}

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity. Of all GPCs' ports
/// together, as if they were busy alike.
struct WdxWork {
  enum : unsigned { taken, handed_on };
  static std::vector<WorkKind> kinds(const WdxBehaviour::Timing& timing, unsigned gpcs);
  /// Of the primitives that it sends to a GPC. A cycle of the latency is that of the queues in which they wait for their turn.
  static PipelineStages pipeline(const WdxBehaviour::Timing& timing) {
    return PipelineStages::of_latency(timing.latency_cycles - 1, timing.primitives_per_cycle);
  }
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_wdx(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
