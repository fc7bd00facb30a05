#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <systemc>

#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/timed_memory_port.h>

/// What makes accesses to a memory, at `cycle` and at `lt`.

namespace vrpipe {

struct Access {
  Cycle at;
  MemoryRequest request;
};

inline constexpr MemoryOrigin color{MemoryTraffic::color, 1};

inline Access read(Cycle at, std::uint64_t address, unsigned bytes = 32) {
  return {at, {address, bytes, tlm::TLM_READ_COMMAND, color}};
}
inline Access write(Cycle at, std::uint64_t address, unsigned bytes = 32) {
  return {at, {address, bytes, tlm::TLM_WRITE_COMMAND, color}};
}

/// A unit of `cycle` that makes accesses in their cycles, or as soon as the memory takes them; and keeps when each was
/// made and when it completed.
class ClockedInitiator : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  ClockedInitiator(const sc_core::sc_module_name& name, ClockDomain& domain, std::vector<Access> accesses)
      : sc_module(name),
        PortOwner({&domain, domain.attach(*this)}),
        memory(*this, "memory", 1000),
        issued(accesses.size(), never),
        completed(accesses.size(), never),
        accesses_(std::move(accesses)) {}

  MemoryPort memory;
  std::vector<Cycle> issued, completed;

 private:
  Cycle tick(Cycle now) override {
    std::uint32_t tag = 0;
    while (memory.next_completed(tag)) completed[tag] = now;
    for (; next_ < accesses_.size() && accesses_[next_].at <= now && memory.available(); ++next_) {
      memory.access(accesses_[next_].request, static_cast<std::uint32_t>(next_));
      issued[next_] = now;
    }
    // Where the memory takes no more, its port comes back.
    const bool waits = next_ == accesses_.size() || accesses_[next_].at <= now;
    return std::min(memory.next_completion(), waits ? never : accesses_[next_].at);
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

}  // namespace vrpipe
