#pragma once

#include <memory>
#include <vector>

#include <systemc>
#include <tlm>

#include "dram.h"
#include "dram_channel.h"

#include <vrpipe/kernel/clock_crossing.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/memory/clocked_target.h>

namespace vrpipe {

/// A DRAM at `cycle`, as a module in the clock of the units: ports of the base protocol in front of channels that count
/// cycles of their own. A request that comes in cycle c enters the queues of its channels at the first edge of the DRAM
/// at or after cycle c + 1, a burst at a time; while a queue is full it is tried again in each cycle, and those behind
/// it that need no full queue overtake it. A port holds a number of such requests; the next one has no END_REQ until
/// the cycle after that in which there is room. Writes are answered once they are queued, reads with the last of their
/// data, in any order, and each the controller's latency later.
class ClockedDram : public Clocked, public sc_core::sc_module {
 public:
  /// `domain` and `behaviour` outlive it.
  ClockedDram(const sc_core::sc_module_name& name, ClockDomain& domain, Dram& behaviour, unsigned ports);
  ~ClockedDram() override;

  tlm::tlm_base_target_socket_b<32>& port(unsigned index);
  DramChannel& channel(unsigned index) { return channels_[index]; }
  /// To be called once: channels go on to the end of the run.
  void close(Cycle end);

  DramUnitStatistics statistics;

 private:
  class Port;
  struct Pending {
    ClockedTarget::Asker asker;
    Cycle arrived;
    Cycle done;  ///< edge of the DRAM at which all of its bursts so far are done
    std::uint16_t port;
    std::uint16_t bursts;  ///< that are not done
    bool reads;
  };
  /// A request that waits at its port for room in a queue.
  struct Waiting {
    std::uint32_t tag;
    std::uint64_t address;
    std::uint16_t bursts, entered;
  };
  Cycle tick(Cycle now) override;
  std::uint32_t take(unsigned port, const ClockedTarget::Asker& asker, Cycle arrived, unsigned bursts, bool reads);
  /// Enters bursts of a port's requests where there is room; returns the next cycle to try again.
  Cycle enter(Port& port, Cycle now, Cycle edge);
  /// The same of a request; false if it has to wait for a channel, which `full` then has, a bit each.
  bool enter(Waiting& waiting, Cycle now, Cycle edge, std::uint64_t& full);
  void collect(DramChannel& channel);
  void answer(std::uint32_t tag);

  ClockDomain& domain_;
  const unsigned handle_;
  Dram& behaviour_;
  const DramSettings& settings_;
  const ClockCrossing clock_;
  DataBusTime data_;
  std::vector<DramChannel> channels_;
  std::vector<Cycle> due_;  ///< by channel: when data of it may be answered next
  std::vector<std::unique_ptr<Port>> ports_;
  std::vector<Pending> pending_;  ///< by tag
  std::vector<std::uint32_t> free_tags_;
};

}  // namespace vrpipe
