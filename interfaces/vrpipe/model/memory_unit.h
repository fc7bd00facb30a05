#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <systemc>
#include <tlm>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/pipeline/slots/memory.h>

namespace vrpipe {

/// The timing model of a memory: SystemC modules with sockets of the unmodified TLM-2.0 base protocol.
class MemoryUnit {
 public:
  virtual ~MemoryUnit() = default;
  /// What a memory port is bound to: port `index`, from 0.
  virtual tlm::tlm_base_target_socket_b<32>& target(unsigned index) = 0;
  /// To be bound to the memory below; null for a memory that has none.
  virtual tlm::tlm_initiator_socket<32>* below() { return nullptr; }
  /// By the sockets: to those above, and from the memory below.
  virtual MemoryBytes delivered() const = 0;
  virtual MemoryBytes memory_bytes() const { return {}; }
  virtual MemoryBehaviour& behaviour() = 0;
  /// Called once, at the end of the frame: a memory that does things late does what is due before cycle `end`.
  virtual void close(Cycle end) { static_cast<void>(end); }
  /// That depend on time; those of the functional model are reported with them.
  virtual const StatisticSet& statistics() const = 0;
  /// At `lt`, which answers requests in the order of calls: whether it tells in which order they come. Not where none waits for
  /// another one; where few do, only if no unit is busy all the time, since it hides what memory takes.
  enum class Order : std::uint8_t { does_not_matter, is_hidden_by_units, matters };
  /// After a run of so many cycles. `is_bottleneck`: nothing else of the platform was busier.
  virtual Order order(Cycle /*end*/, bool is_bottleneck) const {
    return is_bottleneck ? Order::matters : Order::does_not_matter;
  }
  /// What its time went on, up to the end of the frame.
  virtual std::vector<OccupancyPart> parts(Cycle end) const = 0;
};

/// Where a memory stands in its platform.
struct MemoryPlace {
  /// Of each memory port that is bound to it: bytes that it moves in a cycle, in each direction; 0 leaves that to the
  /// memory. The port of a memory above has what those that are bound to that have in all.
  std::vector<unsigned> ports;
  bool has_below;   ///< there is a memory below it
  bool is_clocked;  ///< `cycle`; at `lt` its time is annotated

  /// The same, with what a memory gives to a port.
  std::vector<unsigned> port_bytes(unsigned own) const {
    std::vector<unsigned> bytes = ports;
    std::replace(bytes.begin(), bytes.end(), 0U, own);
    return bytes;
  }
};
/// Makes the timing model of a slot around a functional model. Throws UserError for a place that it cannot take.
using MemoryUnitMaker =
    std::function<std::unique_ptr<MemoryUnit>(const std::string& name, ClockDomain& domain,
                                              std::unique_ptr<Behaviour> behaviour, const MemoryPlace& place)>;

/// Registered by each timing model for its slot. A second one for a slot is a problem of the registry's.
void register_memory_unit_maker(const std::string& slot, MemoryUnitMaker maker);
const MemoryUnitMaker& memory_unit_maker(const std::string& slot);

}  // namespace vrpipe
