#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

class Hierarchy;
class RunAhead;
class Border;

/// A platform with time: its netlist, elaborated as SystemC modules, in which gpc0.crop is a child of gpc0.
class Gpu {
 public:
  struct Placed {
    const Instance* instance;
    std::unique_ptr<Unit> unit;
    Behaviour* behaviour;  ///< whose counters count
  };

  struct PlacedMemory {
    const Instance* instance;
    std::unique_ptr<MemoryUnit> memory;
  };
  /// A memory of another make.
  struct PlacedForeign {
    const ForeignInstance* instance;
    std::unique_ptr<sc_core::sc_module> module;
  };

  Gpu(const Configuration& configuration, Framebuffer& framebuffer);
  ~Gpu();

  /// In the order of the netlist.
  const std::vector<Placed>& units() const { return units_; }
  /// Those that a memory port is bound to.
  const std::vector<PlacedMemory>& memories() const { return memories_; }
  const std::vector<PlacedForeign>& foreign_memories() const { return foreign_memories_; }
  ClockDomain& clock() { return *clock_; }

  /// Runs the frame to its end, or to RunRequest::stop_at; returns the cycles. `progress` goes to 1.
  Cycle run(std::atomic<float>* progress);
  /// Whether the run ended at RunRequest::stop_at, before its frame.
  bool stopped() const { return stopped_; }

 private:
  void add(const Instance& instance, Framebuffer& framebuffer);
  using TargetSockets = std::vector<tlm::tlm_base_target_socket_b<32>*>;
  void add_memories();
  /// @param ports  as MemoryPlace has them
  /// Of a unit's memory port, or of all that are bound to a memory above; 0 if not all say.
  unsigned memory_bytes_per_cycle(const std::string& path) const;
  TargetSockets make_memory(const Instance& instance, const std::vector<unsigned>& ports);
  TargetSockets make_foreign(const ForeignInstance& foreign, unsigned ports);
  void bind_memory(const std::string& path, const std::vector<std::string>& bound, const TargetSockets& sockets);
  void check() const;
  /// Whether the draw has ended everywhere, no unit has work left and no access to memory is under way.
  bool frame_is_over() const;
  /// Closes all accounts with this cycle; returns it.
  Cycle close(Cycle end, std::atomic<float>* progress);
  Unit* find(const std::string& path) const;
  /// Of a unit that is simulated cycle by cycle among others at lt; null for another.
  Border* border_of(const std::string& path) const;

  const Configuration& configuration_;
  std::unique_ptr<ClockDomain> clock_;
  std::unique_ptr<Hierarchy> hierarchy_;
  EffectGate kernel_time_gate_;
  std::map<std::string, std::unique_ptr<Border>> borders_;  ///< by path
  std::vector<PlacedMemory> memories_;
  std::vector<PlacedForeign> foreign_memories_;
  std::map<unsigned, std::unique_ptr<RunAhead>> ahead_;  ///< by GPC, in strict termination
  std::vector<Placed> units_;
  bool stopped_ = false;
};

}  // namespace vrpipe
