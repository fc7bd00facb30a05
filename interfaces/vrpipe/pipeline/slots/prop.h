#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

struct PropTime;

/// Slot `prop`: hands bins to ZROP and on to QRU, and shaded warps to CROP in order.
class PropBehaviour : public Behaviour {
 public:
  /// What its work takes: the parameters of its timing models (modules/prop/prop.h).
  virtual const PropTime& time() const = 0;
};

/// The slot's kinds of work.
struct PropWork {
  /// Quads, those to be tested late as well; and what empty warps take of the way to CROP, in parts of a cycle (RateLimit).
  enum : unsigned { bins, tested, color, empty_warps, late };
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_prop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
