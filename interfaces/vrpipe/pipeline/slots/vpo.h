#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Slot `vpo`: primitive assembly, culling, clipping to the viewport, bounding boxes.
class VpoBehaviour : public Behaviour {
 public:
  /// The visible triangles of a splat of a draw, in order. Returns how many of `out` are set (0 to 2).
  virtual unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) = 0;
  virtual Throughput timing() const = 0;  ///< items: triangles

  void add_to(Counts& counts, const CountOf& of) const override { counts.primitives += of(primitives); }

  DrawCounter primitives{*this, "primitives", "triangles", "triangles handed to the GPCs"};
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct VpoWork {
  enum : unsigned { triangles };
  static std::vector<WorkKind> kinds(const Throughput& timing);
  /// Of the primitives that it sends.
  static PipelineStages pipeline(const Throughput& timing) {
    return PipelineStages::of_latency(timing.latency_cycles, timing.items_per_cycle);
  }
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_vpo(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
