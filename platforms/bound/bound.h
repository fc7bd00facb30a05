#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "elaboration/untimed_gpu.h"

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/zrop.h>
#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

/// The units of a GPC, and of the front end, that its phases are about, in the order in which work goes through them.
struct Pipeline {
  enum Place : unsigned { draw, vpo, tgc, raster, tc, prop, zrop, qru, sm, crop, places };
  Pipeline(const UntimedGpu& gpu, unsigned gpc);
  /// Throws UserError for a slot that is not registered.
  static unsigned rank(Place place);
  /// `places` for another slot.
  static Place place_of(const std::string& slot);

  std::array<UntimedUnit*, places> at{};  ///< null where the platform does without
};

/// What they did, by the kinds of work of each.
struct Work {
  using Items = UntimedUnit::Items;
  std::array<Items, Pipeline::places> of{};
  std::uint64_t attribute_bytes_written = 0;

  void add(const Work& other);
  /// What it took to make quads.
  void set_front_end(const Work& other) {
    std::copy(other.of.begin(), other.of.begin() + Pipeline::tc, of.begin());
    of[Pipeline::sm][SmWork::vertex] = other.of[Pipeline::sm][SmWork::vertex];
    attribute_bytes_written = other.attribute_bytes_written;
  }
  std::uint64_t& rasterized() { return of[Pipeline::raster][RasterWork::quads]; }
  std::uint64_t rasterized() const { return of[Pipeline::raster][RasterWork::quads]; }
  /// What QRU was given, and the warps that it made of it.
  std::uint64_t& survivors() { return of[Pipeline::qru][QruWork::quads]; }
  std::uint64_t survivors() const { return of[Pipeline::qru][QruWork::quads]; }
  std::uint64_t& warps() { return of[Pipeline::qru][QruWork::launches]; }
  std::uint64_t warps() const { return of[Pipeline::qru][QruWork::launches]; }
};

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
  /// The GPU outlives it.
  PhaseBound(const Configuration& configuration, const UntimedGpu& gpu, unsigned gpc);

  const Pipeline& pipeline() const { return pipeline_; }

  Work work;  ///< of the phase
  bool phase_is_full() const { return warps_in_phase_ > 0 && work.warps() >= warps_in_phase_; }
  /// The work so far includes a quad that was rasterised.
  void quad_rasterized() { up_to_quad_.set_front_end(work); }
  /// All quads so far have been blended or dropped. Where a time-out flushes the last bins, what made no quad any more
  /// does not come before.
  void quads_ended() {
    up_to_quads_ = work;
    if (terms_.bins_vary) up_to_quads_.set_front_end(up_to_quad_);
    // For a pair without quads nobody waits.
    up_to_quads_.of[Pipeline::raster][RasterWork::pairs] = up_to_quad_.of[Pipeline::raster][RasterWork::pairs];
    // What has survived was rasterised, though the last of it may be known by that alone (WorkCounter).
    const std::uint64_t survivors = total_.survivors() + work.survivors();
    const std::uint64_t rasterized = total_.rasterized() + up_to_quads_.rasterized();
    if (survivors > rasterized) up_to_quads_.rasterized() += survivors - rasterized;
  }
  void end_phase();
  /// A barrier: what follows begins once the last quad of the phases so far has ended.
  void pass_barrier();
  /// Of a fragment warp.
  std::uint64_t instructions_of(FragmentShader shader) const;
  /// Up to the last quad; without quads, of what the front end does all the same.
  double cycles() const { return last_quad_; }
  bool has_quads() const { return ended_.rasterized() > 0; }
  /// What runs with time may do otherwise than the one whose work this counts.
  const BoundTerms& terms() const { return terms_; }

  /// Of all phases, up to the last quad: what a unit of the pipeline spends its time on at its peak.
  std::vector<OccupancyPart> parts(Pipeline::Place place) const { return parts_of(place, ended_, true); }
  /// And the memory that CROP's is bound to, if it follows no accesses: its path, and cycles.
  const std::string& memory() const { return memory_; }
  double memory_cycles() const { return from_memory(ended_.of[Pipeline::crop][CropWork::bytes_moved]); }

 private:
  /// In the order of the pipeline; PROP is there twice.
  enum Stage : unsigned { draw, vpo, tgc, raster, tc, test, qru, sm, late, color, memory_of_crop, crop, stages };
  std::array<double, stages> cycles_of(const Work& done, bool to_last) const;
  std::array<double, stages> end_of(const Work& done, bool to_last) const;
  UntimedUnit* unit(Pipeline::Place place) const { return pipeline_.at[place]; }
  std::vector<OccupancyPart> parts_of(Pipeline::Place place, const Work& done, bool to_last) const;
  double least(Pipeline::Place place, const Work& done, bool to_last) const;
  /// Of the quads that were rasterised, those that came to TC.
  std::uint64_t collected(const Work& done) const;
  double from_memory(std::uint64_t bytes) const;
  /// Between a stage's items are more cycles than an item takes: those after the last, for which nobody waits.
  double idle_after_last(unsigned stage) const;

  const Pipeline pipeline_;
  const SmTime* sm_ = nullptr;  ///< where there is one
  std::string memory_;
  std::uint32_t memory_bytes_per_cycle_ = 0;  ///< 0: a memory of which nothing is known
  BoundTerms terms_;
  std::uint64_t warps_in_phase_ = 0;
  Work total_;        ///< of the phases before
  Work up_to_quad_;   ///< of the phase's front end, up to the last quad that was rasterised
  Work up_to_quads_;  ///< of the phase, up to its last quad
  Work ended_;        ///< of all phases, up to the last quad
  double last_quad_ = 0;
  std::array<double, stages> end_{};         ///< of the last phase
  std::array<double, stages> end_before_{};  ///< of the phase before it
};

}  // namespace vrpipe
