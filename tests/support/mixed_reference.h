#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include <vrpipe/arithmetic/running_bound.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe::testing {

/// Whether a value passes, from a table of the OpenGL specification: by whether it is less, equal or greater.
bool passes_by_table(Compare compare, double tested, double stored);
/// What a stencil operation makes of a value of 7 bits, from the same specification.
unsigned stencil_by_table(StencilOperation operation, unsigned stored, unsigned reference);

/// Whether a draw's tests come after its shader: it asks for that, or the shader discards and the tests write something. By the
/// rules of OpenGL (4.6, 14.9 and 17.3).
bool is_tested_late(const DrawState& state);

/// What became of a draw's fragments, where no pixel terminates.
struct MixedCounts {
  std::uint64_t rasterized = 0, failed = 0, unshaded = 0, pruned = 0, late_failed = 0, blended = 0;
};

/// A frame as order alone makes it: sample by sample, without tiles, quads, queues, merging or termination. Coverage and depth
/// of triangles are exact but for one rounding, all else is in double.
struct MixedReference {
  std::uint32_t width = 0, height = 0;
  std::vector<std::array<double, 4>> rgba;  ///< row by row, premultiplied
  std::vector<PixelBound> bound;            ///< of RGBA16F, rounded to the nearest
  std::vector<std::uint32_t> depth;         ///< as stored
  std::vector<unsigned> stencil;
  std::vector<MixedCounts> of_draw;
  std::uint64_t near_prune_edge = 0;  ///< fragments whose fate rounding may decide
};
MixedReference render_mixed(const RenderContext& context);

/// Frames that differ by their key alone, as far as order goes: each is rendered once a process.
class MixedReferences {
 public:
  const MixedReference& of(std::uint64_t key, const RenderContext& context) {
    const auto [place, is_new] = references_.try_emplace(key);
    if (is_new) place->second = render_mixed(context);
    return place->second;
  }

 private:
  std::map<std::uint64_t, MixedReference> references_;
};

}  // namespace vrpipe::testing
