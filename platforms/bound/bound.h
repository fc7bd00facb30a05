#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/prop.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/zrop.h>
#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

/// What it takes to make quads.
struct FrontEndWork {
  std::uint64_t vertex_warps_issued = 0;
  std::uint64_t vertex_warps = 0;  ///< shaded
  std::uint64_t attribute_bytes_written = 0;
  std::uint64_t triangles = 0;
  std::uint64_t bin_entries = 0;
  std::uint64_t setups = 0;
  std::uint64_t coarse_tiles = 0;
  std::uint64_t fine_tiles = 0;
  std::uint64_t tile_pairs = 0;
  std::uint64_t quads_rasterized = 0;
};

/// What the units of a GPC did, in the terms of their costs, and the front end for it.
struct Work : FrontEndWork {
  std::uint64_t bin_beats = 0;
  std::uint64_t quads_tested = 0;
  std::uint64_t updates = 0;
  std::uint64_t z_sectors = 0;  ///< filled into the z-cache, in whole cycles of it
  std::uint64_t z_lines = 0;    ///< thousandths of a cycle of lines, beside the tests
  std::uint64_t z_blocks = 0;   ///< thousandths of a cycle beyond what quads_tested take
  std::uint64_t survivors = 0;
  std::uint64_t late_quads = 0;  ///< tested after shading
  std::uint64_t warps = 0;
  std::uint64_t fragment_instructions = 0;  ///< of these warps
  std::uint64_t merging_warps = 0;
  std::uint64_t launches = 0;  ///< of warps, thousandths of a cycle
  UntimedUnit::Items crop{};   ///< by kind of CropWork
  std::uint64_t color_quads() const;

  void add(const Work& other);
};

/// Cycles of the resource that has most.
double busiest(const std::vector<OccupancyPart>& parts);

/// The least cycles that a GPC's work takes when every unit works at its peak: the busiest unit's, phase by phase, up to
/// the last quad. What follows it (splats that cover nothing) is no part of a draw's cycles.
///
/// The whole draw's busiest unit alone would overlap what cannot overlap: where everything is terminated the rasteriser
/// is the busiest, where nothing is CROP, and between the two there is room for a limited number of warps only. So the
/// draw is cut into phases in each of which more warps are launched than there is room for between TC and the end of
/// CROP. Then, by each unit's order and by that room, a unit begins a phase no earlier than
/// - it, or any unit before it in the pipeline, has finished the phase before,
/// - any unit after it has finished the last phase but one (units from the rasteriser on).
class PhaseBound {
 public:
  /// Whether this is a slot of the pipeline.
  static bool knows(const std::string& slot);
  /// A slot that the platform does without takes no time. The CROP of the GPC outlives it; null for none.
  PhaseBound(const Configuration& configuration, const UntimedUnit* crop_unit, unsigned gpc);

  Work work;  ///< of the phase
  bool phase_is_full() const { return work.warps >= warps_in_phase_; }
  /// The work so far includes a quad that was rasterised.
  void quad_rasterized() { up_to_quad_ = static_cast<const FrontEndWork&>(work); }
  /// All quads so far have been blended or dropped. Where a time-out flushes the last bins, what made no quad any more
  /// does not come before.
  void quads_ended() {
    up_to_quads_ = work;
    if (times_out_) static_cast<FrontEndWork&>(up_to_quads_) = up_to_quad_;
    up_to_quads_.tile_pairs = up_to_quad_.tile_pairs;  // for a pair without quads nobody waits
    // What has survived was rasterised, though the last of it may be known by that alone (WorkCounter).
    const std::uint64_t survivors = total_.survivors + work.survivors;
    const std::uint64_t rasterized = total_.quads_rasterized + up_to_quads_.quads_rasterized;
    if (survivors > rasterized) up_to_quads_.quads_rasterized += survivors - rasterized;
  }
  void end_phase();
  /// A barrier: what follows begins once the last quad of the phases so far has ended.
  void pass_barrier();
  /// Of a fragment warp.
  std::uint64_t instructions_of(FragmentShader shader) const;
  /// Up to the last quad; without quads, of what the front end does all the same.
  double cycles() const { return last_quad_; }
  bool has_quads() const { return ended_.quads_rasterized > 0; }
  /// In time, bins may be flushed that are not full.
  bool times_out() const { return times_out_; }
  /// Of so many sectors that every run fills into the z-cache in a phase, those that no earlier phase can have filled for it:
  /// look-ups run ahead by the quads of a queue.
  std::uint64_t z_sectors_of(std::uint64_t filled) const;
  /// The same of lines, in thousandths of a cycle.
  std::uint64_t z_lines_of(std::uint64_t moved) const {
    const std::uint64_t ahead = std::uint64_t{zrop_.z_cache.input_quads} * zrop_.z_cache.line_thousandths;
    return moved > ahead ? moved - ahead : 0;
  }
  /// What runs with time may do otherwise than the one whose work this counts.
  BoundTerms terms() const {
    // Tiles may overtake each other, unless PROP keeps their order.
    return {times_out_, times_out_ || prop_.order == PropBehaviour::Order::tile, l2_latency_cycles_};
  }

  /// Of all phases, up to the last quad: what the unit of a slot, or `l2`, spends its time on at its peak; none for a slot that
  /// this knows nothing of.
  std::vector<OccupancyPart> parts(const std::string& slot) const;

 private:
  /// In the order of the pipeline; PROP is there twice.
  enum Stage : unsigned { draw, vpo, tgc, raster, tc, test, qru, sm, late, color, l2, crop, stages };
  std::array<double, stages> cycles_of(const Work& done, bool to_last) const;
  std::array<double, stages> end_of(const Work& done, bool to_last) const;
  double instructions(const Work& done) const;
  double update_cycles(const Work& done) const;
  /// Beside beats that take several cycles updates take nothing of their own.
  bool updates_hide() const;
  double sector_cycles(const Work& done) const;
  /// Thousandths of a cycle of one hand-over, and of one beat's tests.
  std::uint64_t longest_launch() const;
  std::uint64_t longest_beat_of_blocks() const;
  /// Between a stage's items are more cycles than an item takes: those after the last, for which nobody waits.
  double idle_after_last(unsigned stage) const;

  double vertex_warps_per_cycle_ = 1;
  Throughput vpo_;
  Throughput tgc_;
  RasterBehaviour::TimingParameters raster_{1, 1000, 1, 1, 1000, 1};
  TcBehaviour::TimingParameters tc_{1, 1, 0, 1};
  PropBehaviour::TimingParameters prop_{1, {}, 1, PropBehaviour::Order::tile};
  ZropBehaviour::TimingParameters zrop_{1, 1, 1};
  Throughput qru_;
  SmBehaviour::TimingParameters sm_{1, 1, 32, 1, 1, 1, {}, {}, {}};
  const UntimedUnit* crop_;
  std::uint32_t l2_bytes_per_cycle_ = 0;  ///< 0: a memory of which nothing is known
  std::uint32_t l2_latency_cycles_ = 0;
  std::uint64_t warps_in_phase_ = 0;
  Work total_;               ///< of the phases before
  FrontEndWork up_to_quad_;  ///< of the phase, up to the last quad that was rasterised
  Work up_to_quads_;         ///< of the phase, up to its last quad
  Work ended_;               ///< of all phases, up to the last quad
  bool times_out_ = false;
  double last_quad_ = 0;
  std::array<double, stages> end_{};         ///< of the last phase
  std::array<double, stages> end_before_{};  ///< of the phase before it
};

}  // namespace vrpipe
