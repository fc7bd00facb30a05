#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Slot `qru`: forms warps from the surviving quads of a bin.
class QruBehaviour : public Behaviour {
 public:
  /// Examines quads of a bin, until all `count` are examined or a warp is complete. Returns the number examined, 0 only
  /// together with a launch; `launched` tells whether `out` was filled. Quads of draws that are tested late or
  /// not blended are not to be merged (DrawState::merges).
  virtual unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) = 0;
  /// At the end of a bin: the next warp of what is left; false when nothing is.
  virtual bool finish_bin(Warp& out) = 0;
  virtual Throughput timing() const = 0;            ///< items: quads examined
  virtual std::uint64_t storage_bytes() const = 0;  ///< of hardware
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct QruWork {
  enum : unsigned { quads, launches };  ///< quads examined in cycles without a launch, which ends a cycle
  static std::vector<WorkKind> kinds(const Throughput& timing);
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_qru(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
