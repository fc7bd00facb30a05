#pragma once

#include <cstdint>
#include <vector>

#include "address_map.h"
#include "dram_parameters.h"

#include <vrpipe/memory/memory_request.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/memory.h>

namespace vrpipe {

/// What timing models need of the parameters.
struct DramSettings {
  explicit DramSettings(const DramParameters& parameters);
  /// The bursts of a request, at least one.
  unsigned bursts(unsigned bytes) const { return bytes <= burst_bytes ? 1 : bytes / burst_bytes; }

  DramTiming timing;
  DramAddressMap map;
  unsigned channels, burst_bytes, port_requests;
  std::uint64_t tck_ps, controller_ps;
};

/// A DRAM without time: counts what is asked of it, and how much of it every order of time has to move. Data stays with
/// the functional models.
class Dram final : public MemoryBehaviour {
 public:
  /// Throws UserError for a DRAM that cannot be.
  Dram(const DramParameters& parameters, const RenderContext& context);

  void access(const MemoryRequest& request) override;
  /// Of an access with time: what it costs is found out elsewhere.
  void count(const MemoryRequest& request) { traffic_.count(request); }
  MemoryBytes delivered() const override { return traffic_.bytes(); }
  /// The data bus of the channel that moves the most.
  std::vector<OccupancyPart> least_occupancy(double period_ps) const override;
  TimingParameters timing() const override { return timing_; }

  const MemoryTrafficCounters& traffic() const { return traffic_; }
  const DramSettings& settings() const { return settings_; }
  /// Of dram.refresh, for timing models.
  const EffectGate& refresh_gate() const { return refresh_gate_; }

 private:
  struct Channel {
    std::uint64_t bursts = 0;            ///< that have to be moved
    std::vector<std::uint64_t> written;  ///< lately, in a ring: they may still be in the queue
    std::size_t next = 0;
  };
  const DramSettings settings_;
  EffectGate refresh_gate_;
  TimingParameters timing_;
  std::vector<Channel> channels_;  ///< without time
  MemoryTrafficCounters traffic_{*this};
};

}  // namespace vrpipe
