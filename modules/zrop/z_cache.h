#pragma once

#include <cstdint>

#include "zrop_parameters.h"

#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// How many halves, 4x8 pixels, of 8x8 blocks of a screen tile have quads.
unsigned halves_of_blocks(const Quad* quads, unsigned count);

/// The z-cache, of a ZROP with a memory port. Where that is not connected it holds everything, and nothing is moved.
struct ZCache {
  /// Throws UserError for one that cannot be: CacheOrganization::check; a sector holds a quad of the target. A line is of one
  /// screen tile: no longer one can be set.
  ZCache(const ZropParameters& parameters, DepthFormat format);

  const CacheOrganization organization;
  const std::uint32_t mshrs;              ///< sectors that are filled at a time
  const std::uint32_t input_quads;        ///< queue between look-up and test
  const std::uint32_t input_halves;       ///< the same of halves of blocks, behind a second look at tags; 0: quads
  const std::uint32_t input_updates;      ///< the same of updates, signals
  const std::uint32_t sectors_per_cycle;  ///< filled or written back in a cycle in which nothing is tested or updated
  const bool fast_clear;                  ///< sectors that a clear has left as they are in memory are not read
  const std::uint32_t fetch_ahead_lines;  ///< between two looks at tags, if there are two
  /// Whether a line may go while it is fetched for a test.
  bool fetches_ahead() const { return fetch_ahead_lines > 0; }
  /// Places of the queue in front of the test, and those that quads of a primitive in a screen tile take.
  std::uint32_t places() const { return counts_halves() ? input_halves : input_quads; }
  unsigned places_of(const QuadBeat& beat) const {
    return counts_halves() ? halves_of_blocks(beat.quads.data(), beat.count) : beat.count;
  }

 private:
  bool counts_halves() const { return fetches_ahead() && input_halves > 0; }
};

}  // namespace vrpipe
