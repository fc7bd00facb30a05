#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// What a unit returns is checked at every call (checked_behaviours.h), which takes time, unless it is trusted: the units
/// of this repository are, whose tests check it.
enum class Trust : std::uint8_t { checked, trusted };

/// An optional port of a unit that some frames need: a platform where it is not connected cannot draw these.
struct PortNeed {
  std::string port;
  std::function<bool(const RenderContext&)> is_needed;
  std::string why;
  std::string remedy;
};

/// Values of a parameter for which `lt` was compared with `cycle`: of one that decides how much can be under way, and for how
/// long. There a warp or a bin that moves in one piece may tell; rates of units do not matter to that.
struct ValidatedRange {
  std::string parameter;
  std::uint64_t least, most;
};

/// A kind of unit that platforms are built of. Instances of it have paths, such as gpc0.tc.
struct Slot {
  std::string name;            ///< e.g. "tc"
  unsigned rank = 0;           ///< by which slots are listed: the order in which a frame flows through them
  std::string implementation;  ///< what is in it, unless a user or a platform says otherwise
  std::string stand_in = {};   ///< what is there in a variant without quad merging; empty if that changes nothing
  bool reports_utilization = false;
  SlotCheck check = nullptr;  ///< for units that are not trusted; null if nothing of theirs is checked
  bool is_memory = false;     ///< of memories (MemoryBehaviour), which have no streams but are bound to memory ports
  std::vector<ValidatedRange> validated = {};  ///< of parameters that are not named every value is
  std::vector<PortNeed> needs = {};
  /// Of kernels by which a frame is prepared or rendered in software, and of accelerators: no pipeline has a unit of it
  /// (slots/kernel_work.h, slots/accelerator.h).
  bool is_outside_pipeline = false;
};

/// An implementation of a slot: a unit that a platform can be built with.
struct Implementation {
  std::string slot;           ///< name of the slot
  std::string name;           ///< e.g. "pairing"
  std::string description;    ///< one line
  bool pass_through = false;  ///< stands in for a unit that a variant does not have
  Trust trust = Trust::checked;
  /// Of an SM array or a CROP: it hands on, or asks for, what warps cover (RenderContext::hands_on_coverage).
  bool knows_coverage = false;
  std::function<std::unique_ptr<ParameterSet>()> make_parameters;
  std::function<std::unique_ptr<Behaviour>(const ParameterSet&, const RenderContext&)> make_behaviour;
};

/// All implementations that are linked in or loaded. Filled by static registrars; there is one per process.
class Registry {
 public:
  static Registry& instance();

  /// A second slot of a name is not taken but kept as a problem.
  void add(Slot slot);
  /// A second implementation of a slot and name, or one of an unknown slot, is not taken but kept as a problem:
  /// registrars run while a library is loaded, when nothing may be thrown.
  void add(Implementation implementation);
  /// Why something could not be registered, and what to do about it.
  struct Problem {
    std::string why;
    std::string remedy;
  };
  void add_problem(Problem problem) { problems_.push_back(std::move(problem)); }
  /// The problem that a name cannot be one (names.h).
  void add_bad_name(const std::string& what, const std::string& name);
  void count_registration() { ++registrations_; }
  /// Of everything, so that a plugin that registers nothing is told.
  std::size_t registrations() const { return registrations_; }
  /// The problems since the last call.
  std::vector<Problem> take_problems() { return std::exchange(problems_, {}); }
  /// Throws UserError naming the nearest slot or implementation.
  const Implementation& find(const std::string& slot, const std::string& name) const;
  /// In order of slot in the pipeline, then of name.
  std::vector<const Implementation*> all() const;
  std::vector<const Implementation*> of_slot(const std::string& slot) const;

  /// All slots, in the order of their ranks.
  const std::vector<Slot>& slots() const { return slots_; }
  bool has_slot(const std::string& name) const;
  /// Throws UserError naming the nearest.
  const Slot& slot(const std::string& name) const;
  std::vector<std::string> slot_names() const;

 private:
  std::vector<Slot> slots_;
  std::vector<std::unique_ptr<Implementation>> implementations_;
  std::vector<Problem> problems_;
  std::size_t registrations_ = 0;
};

/// Registers a slot at program or plugin load, before its implementations.
struct SlotRegistrar {
  explicit SlotRegistrar(Slot slot, std::vector<ValidatedRange> validated = {}, std::vector<PortNeed> needs = {}) {
    slot.validated = std::move(validated);
    slot.needs = std::move(needs);
    Registry::instance().add(std::move(slot));
  }
};

/// Registers a slot outside the pipeline: of kernels or accelerators.
struct OutsideSlotRegistrar {
  OutsideSlotRegistrar(const char* name, unsigned rank, const char* implementation) {
    Slot slot{name, rank, implementation};
    slot.is_outside_pipeline = true;
    Registry::instance().add(std::move(slot));
  }
};

/// Registers a behaviour class at program or plugin load. `Unit` has a nested `Parameters` (a ParameterSet) and a
/// constructor (const Parameters&, const RenderContext&), and derives from the slot's behaviour.
template <class Unit, class SlotBehaviour>
class Registrar {
  static_assert(std::is_base_of<SlotBehaviour, Unit>::value, "a unit implements the behaviour of its slot");

 public:
  Registrar(const char* slot, const char* name, const char* description, bool pass_through = false,
            Trust trust = Trust::checked, bool knows_coverage = false) {
    Implementation implementation;
    implementation.slot = slot;
    implementation.name = name;
    implementation.description = description;
    implementation.pass_through = pass_through;
    implementation.trust = trust;
    implementation.knows_coverage = knows_coverage;
    implementation.make_parameters = [] { return std::make_unique<typename Unit::Parameters>(); };
    implementation.make_behaviour = [](const ParameterSet& parameters, const RenderContext& context) {
      return std::make_unique<Unit>(dynamic_cast<const typename Unit::Parameters&>(parameters), context);
    };
    Registry::instance().add(std::move(implementation));
  }
};

/// Put VRPIPE_PLUGIN once in a plugin's source: the tag by which the loader knows, before it runs any code of the
/// plugin, that it was built for this vrpipe. VRPIPE_PLUGIN_TAG comes from the build (vrpipe_add_plugin).
#define VRPIPE_PLUGIN                                                               \
  extern "C" __attribute__((visibility("default"))) const char vrpipe_plugin_tag[]; \
  extern "C" __attribute__((visibility("default"), used)) const char vrpipe_plugin_tag[] = VRPIPE_PLUGIN_TAG;

/// Loads a plugin; its units and platforms can be used afterwards. Throws UserError when the file is missing, is not a
/// plugin of vrpipe, was built against another version, is loaded already, registers nothing or something that is there
/// already. An initialiser that throws ends the program: the loader lets no exception through.
void load_plugin(const std::string& path);
/// The paths of those loaded, in order.
const std::vector<std::string>& loaded_plugins();
/// While `load_plugin` runs a plugin's initialisers.
bool is_loading_plugin();

}  // namespace vrpipe
