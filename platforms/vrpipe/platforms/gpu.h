#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/clock_domain.h>
#include <vrpipe/memory_port.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/unit.h>

namespace vrpipe {

/// A GPU under construction, at any fidelity with time, and then in operation. A platform's `wire` function adds units and
/// connects their ports by name; which implementation a slot gets is the configuration's choice, not the diagram's.
class Gpu {
 public:
  Gpu(const Configuration& configuration, ColorSurface& surface);
  ~Gpu();

  unsigned gpcs() const;

  /// Adds the unit of a slot to the front end ("draw") or to a GPC ("gpc0.tc").
  Unit& add_front_end(const std::string& slot);
  Unit& add(unsigned gpc, const std::string& slot);

  /// Connects "draw.out_vertices_0" to "gpc0.sm.in_vertices"; see StreamOut::connect. Port names without a unit of
  /// this GPU, ports that carry different items and ports in use throw UserError.
  void connect(const std::string& out, const std::string& in, unsigned depth = 4, unsigned latency = 1);

  /// Binds the memory port of a unit to the shared L2.
  void connect_to_l2(const std::string& unit);

  Unit& unit(const std::string& name);
  const std::vector<std::unique_ptr<Unit>>& units() const { return units_; }
  /// As in the wiring diagram, in the order of `units()`.
  const std::vector<std::string>& unit_names() const { return names_; }
  const FixedLatencyMemory& l2() const { return *l2_; }
  ClockDomain& clock() { return *clock_; }

  /// Runs the draw to its end; returns the cycles. `progress` goes to 1.
  Cycle run(std::atomic<float>* progress);

 private:
  Unit& add_unit(const std::string& name, const std::string& slot, const RenderState& state);
  void wire();
  void check_ports() const;

  const Configuration& configuration_;
  ColorSurface& surface_;
  std::unique_ptr<ClockDomain> clock_;
  std::unique_ptr<FixedLatencyMemory> l2_;
  unsigned l2_ports_ = 0;  ///< in use
  std::vector<std::unique_ptr<Unit>> units_;
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<TerminationForesight>> foresights_;
};

}  // namespace vrpipe
