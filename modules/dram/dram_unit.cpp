#include <vrpipe/component/error.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/model/unit.h>

#include "dram/annotated_dram.h"
#include "dram/clocked_dram.h"

namespace vrpipe {

namespace {

/// The DRAM at `lt` and `cycle`.
template <class Timed>
class DramUnit final : public MemoryUnit {
 public:
  DramUnit(const std::string& name, ClockDomain& domain, std::unique_ptr<Dram> behaviour, unsigned ports)
      : period_ps_(domain.period().to_seconds() * 1e12),
        behaviour_(std::move(behaviour)),
        timed_(name.c_str(), domain, *behaviour_, ports) {}

  tlm::tlm_base_target_socket_b<32>& target(unsigned index) override { return timed_.port(index); }
  MemoryBytes delivered() const override { return behaviour_->delivered(); }
  MemoryBehaviour& behaviour() override { return *behaviour_; }
  const StatisticSet& statistics() const override { return timed_.statistics; }
  void close(Cycle end) override { timed_.close(end); }
  std::vector<OccupancyPart> parts(Cycle) const override {
    const DramSettings& settings = behaviour_->settings();
    const double cycles = static_cast<double>(timed_.statistics.channels.data_cycles.value()) / settings.channels;
    return {{"data", 0, cycles * static_cast<double>(settings.tck_ps) / period_ps_, true}};
  }

 private:
  double period_ps_;
  std::unique_ptr<Dram> behaviour_;
  Timed timed_;
};

[[maybe_unused]] const bool dram_unit_registered = [] {
  register_memory_unit_maker(
      "dram",
      [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
         const MemoryPlace& place) -> std::unique_ptr<MemoryUnit> {
        if (place.has_below) {
          throw UserError("cannot connect memory", name, "nothing lies below a DRAM",
                          "connect its memory port to nothing");
        }
        auto dram = behaviour_as<Dram>(std::move(behaviour));
        if (place.is_clocked) {
          return std::make_unique<DramUnit<ClockedDram>>(name, domain, std::move(dram),
                                                         static_cast<unsigned>(place.ports.size()));
        }
        return std::make_unique<DramUnit<AnnotatedDram>>(name, domain, std::move(dram),
                                                         static_cast<unsigned>(place.ports.size()));
      });
  return true;
}();

}  // namespace

}  // namespace vrpipe
