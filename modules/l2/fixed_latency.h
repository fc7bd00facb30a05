#pragma once

#include <memory>
#include <string>
#include <vector>

#include "l2/own_clock.h"

#include <vrpipe/component/parameter.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// An L2 that answers every access after the same time.
class FixedLatency final : public MemoryBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer latency_cycles{
        *this, "latency_cycles", 146, 1, 100000, "cycles", "Accel-Sim, SM87_ORIN: L2 latency", "from request to data"};
    Integer bytes_per_cycle{*this, "bytes_per_cycle", 128,          32,
                            4096,  "bytes",           source::open, "moved for each GPC: four sectors"};
    OwnClock::Parameter frequency_mhz{*this};
  };
  FixedLatency(const Parameters& parameters, const RenderContext& context)
      : clock_("l2", parameters.frequency_mhz, context),
        own_timing_{parameters.latency_cycles, parameters.bytes_per_cycle} {}

  void access(const MemoryRequest&) override {}
  bool follows_accesses() const override { return false; }
  TimingParameters timing() const override { return clock_.of_units(own_timing_); }
  /// In cycles of its clock.
  const TimingParameters& own_timing() const { return own_timing_; }
  const OwnClock& clock() const { return clock_; }

 private:
  OwnClock clock_;
  TimingParameters own_timing_;
};

/// The same at `lt` and `cycle`.
class FixedLatencyUnit final : public MemoryUnit {
 public:
  FixedLatencyUnit(const std::string& name, ClockDomain& domain, std::unique_ptr<FixedLatency> behaviour,
                   const MemoryPlace& place)
      : behaviour_(std::move(behaviour)),
        memory_(name.c_str(), domain, behaviour_->own_timing().latency_cycles,
                behaviour_->clock().port_bytes(place, behaviour_->own_timing().bytes_per_cycle), below_of(place),
                behaviour_->clock().period_ps()) {}

  tlm::tlm_base_target_socket_b<32>& target(unsigned index) override { return memory_.port(index); }
  tlm::tlm_initiator_socket<32>* below() override { return &memory_.below(); }
  MemoryBytes delivered() const override { return memory_.traffic().bytes(); }
  MemoryBytes memory_bytes() const override { return {memory_.cache().bytes_filled.value(), 0}; }
  MemoryBehaviour& behaviour() override { return *behaviour_; }
  const StatisticSet& statistics() const override { return memory_; }
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
