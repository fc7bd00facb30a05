#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe::walk {

/// A draw of a frame: splats of the scene up to the next part's, and what comes before them.
struct Part {
  std::uint32_t first = 0;       ///< splat of the scene, perhaps beyond its last; 0 in the first part
  std::vector<Setting> own;      ///< of unit `state`, beyond those of the case
  bool terminates_early = true;  ///< where the variant does
  Clear clear;                   ///< before it
  /// A stencil test that passes everywhere: what it writes tells whether the order was kept, and the picture is as without.
  enum class Stencil : std::uint8_t { untested, read_early, read_late, written_late };
  Stencil stencil = Stencil::untested;
  StencilOperation operation = StencilOperation::keep;  ///< that writes
};

/// What a platform of the catalogue is edited by.
struct Edits {
  bool z_caches = false;      ///< connected
  bool l1s = false;           ///< one between each SM array and the L2
  bool tallies = false;       ///< a slot of one's own between RASTER and TC
  unsigned other_memory = 0;  /// of another make, below the L2 or in its place: which one, 0 for none

  bool any() const { return z_caches || l1s || tallies || other_memory != 0; }
  friend bool operator<(const Edits& a, const Edits& b) {
    return std::tie(a.z_caches, a.l1s, a.tallies, a.other_memory) <
           std::tie(b.z_caches, b.l1s, b.tallies, b.other_memory);
  }
};

/// What many cases are of, and what findings are made simpler to.
const Platform& simplest_platform();

/// One configuration and one scene of the random walk.
struct Case {
  std::uint64_t seed = 0;
  std::uint64_t index = 0;
  const Platform* platform = nullptr;  ///< of the catalogue, or one of them edited
  Edits edits;
  Variant variant;
  ColorFormat format = ColorFormat::rgba16f;
  Termination termination = Termination::paper;
  std::vector<Setting> settings;
  std::vector<UnitChoice> units;
  bool refused = false;  ///< the last setting lies outside its declared range
  Draw draw;
  std::vector<Part> parts;   ///< the scene in several draws; none for a single one
  std::uint32_t passes = 1;  ///< of a single one: in which it is drawn (draw_in_passes)
  /// Meshes and splats of a seed, of random depth and stencil states, in place of the scene; 0 for none.
  std::uint64_t mixed_seed = 0;

  /// What is run twice, and once with stalls.
  Fidelity repeated = Fidelity::cycle;
  Fidelity stalled = Fidelity::cycle;
  std::vector<std::string> units_at_cycle;  ///< among others at lt
  std::uint64_t stall_seed = 1;
  /// What is simulated in another run of `repeated`: all effects, or some that the frame may not call for; empty for no such
  /// run.
  std::string effects;

  RunRequest request(Fidelity fidelity) const;
  /// Whether there is nothing but the draw of the scene.
  bool is_single_draw() const { return parts.empty() && passes == 1 && mixed_seed == 0; }
  /// The draws from a part on, which refer to the case's scene.
  Frame frame(std::size_t from = 0) const;
  /// Whether a single draw says the same.
  bool is_mere_split() const;
};

/// The case of a seed and an index: always the same, whichever were drawn before. `real` is a large draw of a trained
/// scene, windows of which are among the scenes.
Case draw_case(std::uint64_t seed, std::uint64_t index, const Draw& real);

/// The case in words, and as a `vrpipe run` of the draw list `scene`, which knows nothing of parts.
std::string describe(const Case& c);
std::string command_line(const Case& c, Fidelity fidelity, const std::string& scene);

}  // namespace vrpipe::walk
