#pragma once

#include <functional>
#include <memory>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/timed_memory_port.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "dram/annotated_dram.h"
#include "dram/clocked_dram.h"

namespace vrpipe::testing {

struct Access {
  Cycle at = 0;  ///< not before it
  MemoryRequest request;
};

inline Access read(Cycle at, std::uint64_t address, unsigned bytes = 32) {
  return {at, {address, bytes, tlm::TLM_READ_COMMAND, {MemoryTraffic::color, 0}}};
}
inline Access write(Cycle at, std::uint64_t address, unsigned bytes = 32) {
  return {at, {address, bytes, tlm::TLM_WRITE_COMMAND, {MemoryTraffic::color, 0}}};
}

/// A unit of `cycle` that makes accesses in their order, each as soon as it may; keeps when it issued each and when it
/// was answered.
class ClockedInitiator : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  ClockedInitiator(const sc_core::sc_module_name& name, ClockDomain& domain, std::vector<Access> accesses,
                   unsigned in_flight = 100000)
      : sc_module(name),
        PortOwner({&domain, domain.attach(*this)}),
        memory(*this, "memory", in_flight),
        issued(accesses.size(), never),
        answered(accesses.size(), never),
        accesses_(std::move(accesses)) {}

  MemoryPort memory;
  std::vector<Cycle> issued, answered;
  unsigned answered_twice = 0;

 private:
  Cycle tick(Cycle now) override {
    std::uint32_t tag = 0;
    while (memory.next_completed(tag)) {
      if (answered[tag] != never) ++answered_twice;
      answered[tag] = now;
    }
    for (; next_ < accesses_.size() && accesses_[next_].at <= now && memory.available(); ++next_) {
      issued[next_] = now;
      memory.access(accesses_[next_].request, static_cast<std::uint32_t>(next_));
    }
    // Held up, it is woken when that ends, or something is answered.
    const Cycle wants = next_ < accesses_.size() && memory.available() ? accesses_[next_].at : never;
    return std::min(memory.next_completion(), wants);
  }
  const std::vector<Access> accesses_;
  std::size_t next_ = 0;
};

/// A unit of `lt`, as far as its memory port is concerned.
class TimedInitiator : public sc_core::sc_module, public PortOwner {
 public:
  TimedInitiator(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, 0}), memory(*this, "memory") {}
  TimedMemoryPort memory;
};

/// A clock of a GPU, and a DRAM of a kind with settings.
class DramBench {
 public:
  DramBench(const std::string& implementation, std::vector<std::pair<std::string, std::string>> settings = {},
            unsigned period_ps = 1000)
      : implementation_(Registry::instance().find("dram", implementation)),
        parameters_(implementation_.make_parameters()),
        period_ps_(period_ps) {
    for (const auto& [name, value] : settings) parameters_->set("dram", name, value);
    start();
  }
  void start() {
    clocked.reset();
    annotated.reset();
    behaviour.reset();
    clock.reset();
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", period_ps_);
    RenderContext context;
    context.clock_ps = period_ps_;
    behaviour = behaviour_as<Dram>(implementation_.make_behaviour(*parameters_, context));
    behaviour->count_least();
  }
  sc_core::sc_time cycles(double count) const { return {count * period_ps_, sc_core::SC_PS}; }
  /// When each of the accesses of a unit is answered, at `cycle`.
  std::vector<Cycle> answered(const std::vector<Access>& accesses, unsigned in_flight = 100000) {
    start();
    clocked = std::make_unique<ClockedDram>("dram", *clock, *behaviour, 1);
    ClockedInitiator unit("unit", *clock, accesses, in_flight);
    unit.memory.socket.bind(clocked->port(0));
    while (!clock->run_to_rest(cycles(100000))) {}
    issued = unit.issued;
    return unit.answered;
  }
  /// The same with annotated time; the accesses need not be in the order of theirs.
  std::vector<Cycle> annotated_answers(const std::vector<Access>& accesses, unsigned in_flight = 100000) {
    start();
    annotated = std::make_unique<AnnotatedDram>("dram", *clock, *behaviour, 1);
    TimedInitiator unit("unit", *clock);
    unit.memory.socket.bind(annotated->port(0));
    clock->run(cycles(1));
    std::vector<Cycle> found;
    std::priority_queue<Cycle, std::vector<Cycle>, std::greater<>> under_way;
    Cycle free = 0;
    for (const Access& access : accesses) {
      if (under_way.size() >= in_flight) {
        free = std::max(free, under_way.top());
        under_way.pop();
      }
      const Cycle now = std::max(free, access.at);
      found.push_back(unit.memory.access(access.request, now));
      under_way.push(found.back());
    }
    return found;
  }

  std::vector<Cycle> issued;
  std::unique_ptr<ClockDomain> clock;
  std::unique_ptr<Dram> behaviour;
  std::unique_ptr<ClockedDram> clocked;
  std::unique_ptr<AnnotatedDram> annotated;

 private:
  const Implementation& implementation_;
  std::unique_ptr<ParameterSet> parameters_;
  unsigned period_ps_;
};

}  // namespace vrpipe::testing
