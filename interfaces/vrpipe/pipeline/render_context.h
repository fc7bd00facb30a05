#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/fragment_observer.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/tile_owners.h>

namespace vrpipe {

/// See the contract: `paper`, an update of the termination bit carries its time; `strict`, order alone decides.
enum class Termination : std::uint8_t { paper, strict };
const char* name_of(Termination termination);
/// Throws UserError naming those that exist.
Termination termination_named(const std::string& name);

/// Where a unit sits.
struct Placement {
  unsigned gpcs = 1;                                   ///< of the platform
  unsigned gpc = 0;                                    ///< that the unit belongs to
  std::shared_ptr<const TileOwners> owners = nullptr;  ///< of the frame's screen tiles; null: one GPC owns all
  bool owns(TileId tile) const { return owners == nullptr || owners->owner_of(tile) == gpc; }
  bool owns_any_of(const PixelRect& pixels) const { return owners == nullptr || owners->has_any(gpc, pixels); }
};

/// What a unit knows of the frame that it takes part in, of the hardware and of its own place.
struct RenderContext {
  std::shared_ptr<const Frame> frame;
  ColorFormat format = ColorFormat::rgba16f;  ///< of the colour target
  DevicePrecision precision;
  Termination termination = Termination::paper;
  Placement placement;
  std::uint64_t clock_ps = 1000;            ///< period of the units' clock, for what has a clock of its own
  std::shared_ptr<OmittedEffects> effects;  ///< null: none is left out
  FragmentObserver* fragments = nullptr;    ///< null: nobody looks
  /// Warps come to CROP with what they cover, quads that are pruned too: a shader that blends takes a lock for these.
  bool hands_on_coverage = false;

  const DrawCall& draw(DrawIndex draw) const { return frame->draw_call(draw); }
  const DrawState& state(DrawIndex draw) const { return frame->draw_call(draw).state; }
  /// Whether a slot or a link is elaborated, for some effect or since it has none (Effect::parts).
  bool has_part(const std::string& part) const { return effects == nullptr || effects->has_part(part); }
};

}  // namespace vrpipe
