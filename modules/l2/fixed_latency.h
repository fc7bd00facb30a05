#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "l2/own_clock.h"

#include <vrpipe/component/error.h>
#include <vrpipe/component/parameter.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// An L2 that answers every access after its latency.
class FixedLatency final : public MemoryBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer latency_cycles{
        *this, "latency_cycles", 146, 1, 100000, "cycles", "Accel-Sim, SM87_ORIN: L2 latency", "from request to data"};
    Integer near_latency_cycles{*this,
                                "near_latency_cycles",
                                0,
                                0,
                                100000,
                                "cycles",
                                "left open by the paper; measured on a GH100 graphics GPC: 242 beside 433 (means)",
                                "of the half of the addresses whose slices are near; 0: latency_cycles"};
    Integer color_latency_cycles{*this,
                                 "color_latency_cycles",
                                 0,
                                 0,
                                 100000,
                                 "cycles",
                                 "left open by the paper; measured on a GH100 graphics GPC: 43",
                                 "that CROP's accesses take more than others"};
    Integer slice_spread_cycles{
        *this,
        "slice_spread_cycles",
        0,
        0,
        100000,
        "cycles",
        "left open by the paper; measured on a GH100 graphics GPC: 17",
        "that a quarter of the near slices, and of the others, takes less than their mean, and a quarter more"};
    Integer bytes_per_cycle{*this, "bytes_per_cycle", 128,          32,
                            4096,  "bytes",           source::open, "moved for each GPC: four sectors"};
    OwnClock::Parameter frequency_mhz{*this};
  };
  /// Throws UserError where the spread leaves no latency.
  FixedLatency(const Parameters& parameters, const RenderContext& context)
      : clock_("l2", parameters.frequency_mhz, context),
        latency_{parameters.latency_cycles,
                 parameters.near_latency_cycles > 0 ? parameters.near_latency_cycles : parameters.latency_cycles,
                 parameters.color_latency_cycles, parameters.slice_spread_cycles},
        bytes_per_cycle_(parameters.bytes_per_cycle) {
    const std::uint32_t nearest = std::min(latency_.near, latency_.far);
    if (latency_.spread < nearest) return;
    throw UserError("unusable L2", "l2.slice_spread_cycles",
                    "the nearest slices would take " + std::to_string(latency_.spread) + " cycles less than " +
                        std::to_string(nearest),
                    "use less than their latency");
  }

  void access(const MemoryRequest&) override {}
  bool follows_accesses() const override { return false; }
  TimingParameters timing() const override { return clock_.of_units({latency_.least(), bytes_per_cycle_}); }
  /// In cycles of its clock, as `bytes_per_cycle`.
  const MemoryLatency& latency() const { return latency_; }
  std::uint32_t bytes_per_cycle() const { return bytes_per_cycle_; }
  const OwnClock& clock() const { return clock_; }

 private:
  OwnClock clock_;
  MemoryLatency latency_;
  std::uint32_t bytes_per_cycle_;
};

/// The same at `lt` and `cycle`.
class FixedLatencyUnit final : public MemoryUnit {
 public:
  FixedLatencyUnit(const std::string& name, ClockDomain& domain, std::unique_ptr<FixedLatency> behaviour,
                   const MemoryPlace& place)
      : behaviour_(std::move(behaviour)),
        memory_(name.c_str(), domain, behaviour_->latency(),
                behaviour_->clock().port_bytes(place, behaviour_->bytes_per_cycle()), below_of(place),
                behaviour_->clock().period_ps()) {}

  tlm::tlm_base_target_socket_b<32>& target(unsigned index) override { return memory_.port(index); }
  tlm::tlm_initiator_socket<32>* below() override { return &memory_.below(); }
  MemoryBytes delivered() const override { return memory_.traffic().bytes(); }
  MemoryBytes memory_bytes() const override { return {memory_.cache().bytes_filled.value(), 0}; }
  MemoryBehaviour& behaviour() override { return *behaviour_; }
  const StatisticSet& statistics() const override { return memory_; }
  /// It has no banks and no rows.
  Order order(Cycle /*end*/, bool /*is_bottleneck*/) const override { return Order::does_not_matter; }
  std::vector<OccupancyPart> parts(Cycle end) const override {
    return {{"bytes", 0, static_cast<double>(memory_.bytes(end)) / memory_.peak_rate(), true}};
  }

 private:
  static MemoryBelow below_of(const MemoryPlace& place) {
    if (!place.has_below) return MemoryBelow::none;
    return place.is_clocked ? MemoryBelow::clocked : MemoryBelow::annotated;
  }

  std::unique_ptr<FixedLatency> behaviour_;
  FixedLatencyMemory memory_;
};

}  // namespace vrpipe
