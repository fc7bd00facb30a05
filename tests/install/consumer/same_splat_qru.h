#pragma once

#include <array>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/units.h>

/// A QRU that pairs only quads of the same splat: those of its two triangles along the diagonal of the box.
///
/// A register for each of the 64 positions of a screen tile holds the last quad that came there. A quad of the same
/// splat pairs with it; one of another splat takes its place, and the held one leaves as a single. Slots of a warp go in
/// twos, since a pair takes slots 2n and 2n + 1; a single waits for another single to share two slots with.
class SameSplatQru : public vrpipe::QruBehaviour {
 public:
  struct Parameters : vrpipe::ParameterSet {
    vrpipe::Integer quads_per_cycle{
        *this, "quads_per_cycle", 8, 1, 16, "quads", "same as unit pairing", "examined in a cycle"};
    vrpipe::Integer latency_cycles{*this,
                                   "latency_cycles",
                                   4,
                                   1,
                                   1000,
                                   "cycles",
                                   "same as unit pairing",
                                   "from the quad that completes a warp to its launch"};
  };
  SameSplatQru(const Parameters& parameters, const vrpipe::RenderContext& context);

  unsigned examine(vrpipe::TileId tile, const vrpipe::Quad* quads, unsigned count, vrpipe::Warp& out,
                   bool& launched) override;
  bool finish_bin(vrpipe::Warp& out) override;
  vrpipe::Throughput timing() const override { return timing_; }
  /// 64 registers of a 4 B pointer and the quad's 4 B, and one for the single that waits.
  std::uint64_t storage_bytes() const override { return (vrpipe::positions_per_tile + 1) * sizeof(vrpipe::Quad); }

 private:
  /// What is tested after shading is not merged.
  bool may_merge(const vrpipe::Quad& quad) const;
  void add_pair(const vrpipe::Quad& front, const vrpipe::Quad& back);
  void add_single(const vrpipe::Quad& quad);
  void fill_slots(const vrpipe::Quad& first, const vrpipe::Quad& second, bool merge);
  bool launch_when_full(vrpipe::Warp& out);
  void launch(vrpipe::Warp& out);

  const vrpipe::RenderContext& context_;
  const vrpipe::Throughput timing_;
  vrpipe::EffectGate pairs_gate_;
  std::array<vrpipe::Quad, vrpipe::positions_per_tile> registers_{};  ///< empty where the coverage is 0
  vrpipe::Quad waiting_{};                                            ///< the single; none when its coverage is 0
  vrpipe::Warp warp_;                                                 ///< being filled
};
