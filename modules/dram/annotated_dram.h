#pragma once

#include <memory>
#include <vector>

#include <systemc>
#include <tlm>

#include "annotated_channel.h"
#include "dram.h"

#include <vrpipe/kernel/clock_crossing.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/memory/memory_port.h>

namespace vrpipe {

/// A DRAM at `lt`: says as soon as a request comes when it will be answered. Its parameters are those of
/// `cycle`, its channels an approximation (annotated_channel.h).
class AnnotatedDram : public sc_core::sc_module {
 public:
  /// `domain` and `behaviour` outlive it.
  AnnotatedDram(const sc_core::sc_module_name& name, ClockDomain& domain, Dram& behaviour, unsigned ports);
  ~AnnotatedDram() override;

  tlm::tlm_base_target_socket_b<32>& port(unsigned index);
  /// To be called once.
  void close(Cycle end);

  DramUnitStatistics statistics;

 private:
  class Port;
  Cycle serve(const MemoryRequest& request, Cycle arrival);

  ClockDomain& domain_;
  Dram& behaviour_;
  const DramSettings& settings_;
  const ClockCrossing clock_;
  DataBusTime data_;
  std::vector<AnnotatedChannel> channels_;
  std::vector<std::unique_ptr<Port>> ports_;
};

}  // namespace vrpipe
