#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

/// A platform without time: its netlist, elaborated.
class UntimedGpu {
 public:
  struct Placed {
    const Instance* instance;
    std::unique_ptr<UntimedUnit> unit;
  };

  struct PlacedMemory {
    const Instance* instance;
    std::unique_ptr<MemoryBehaviour> memory;
  };

  /// ROPs draw into the framebuffer.
  UntimedGpu(const Configuration& configuration, Framebuffer& framebuffer);

  const Configuration& configuration() const { return configuration_; }
  const std::vector<Placed>& units() const { return units_; }
  /// Those that find out what is accessed.
  const std::vector<PlacedMemory>& memories() const { return memories_; }
  /// Of a path; null for one that does not, or none.
  MemoryBehaviour* memory(const std::string& path) const;
  UntimedUnit* unit(const std::string& path) const;  ///< null for none
  /// A slot's unit in a GPC; in a slot of the front end it serves all. Null for none.
  UntimedUnit* of_slot(const std::string& slot, unsigned gpc) const;

  /// `progress`, if given, goes from 0 to 1. `passed`, if given, is called after each vertex warp.
  void run(std::atomic<float>* progress, const std::function<void()>& passed = {});

 private:
  void add_memories();

  const Configuration& configuration_;
  std::vector<Placed> units_;
  std::vector<PlacedMemory> memories_;
};

}  // namespace vrpipe
