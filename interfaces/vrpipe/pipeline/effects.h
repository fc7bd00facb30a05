#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <vrpipe/component/parameter.h>

namespace vrpipe {

struct FrameFacts;
struct RenderContext;

/// What leaving an effect out could change: images and counts, or cycles alone.
enum class EffectKind : std::uint8_t { functional, timing };
const char* name_of(EffectKind kind);

/// Why a run without an effect is the same as one with it.
enum class EffectProof : std::uint8_t {
  by_facts,  ///< "static": frame, camera and platform decide before the run
  verified,  ///< a monitor watches for the first use, and switches the effect on there
  bounded    ///< it is not the same, but no farther off than the reason says
};
const char* name_of(EffectProof proof);

/// What a predicate says of an effect in a run.
struct EffectDecision {
  bool omitted = false;
  EffectProof proof = EffectProof::by_facts;  ///< of what is omitted
  std::string reason;                         ///< in words, with numbers

  static EffectDecision keep(std::string why) { return {false, EffectProof::by_facts, std::move(why)}; }
  static EffectDecision omit(std::string why) { return {true, EffectProof::by_facts, std::move(why)}; }
  /// Left out until the monitor at its entry fires.
  static EffectDecision watch(std::string why) { return {true, EffectProof::verified, std::move(why)}; }
  /// Left out where the user asks for an approximation.
  static EffectDecision bound(std::string bound) { return {true, EffectProof::bounded, std::move(bound)}; }
};

/// What a predicate may look at. Everything is final: the variant's state, the parameters of the instance.
struct EffectQuestion {
  const FrameFacts& facts;
  const RenderContext& context;
  const ParameterSet& parameters;  ///< of the instance; of none, for a component that is no slot
  bool has_time = false;           ///< lt and cycle
  bool counts_work = false;        ///< and bound, whose cycles follow from counts
  bool memory_connected = false;   ///< the instance's port is bound to a memory that is elaborated
  bool meets_own_time = false;     ///< a memory of another make is there, with time of its own
  unsigned observed_links = 0;
  bool reads_statistics = true;
  template <class Parameters>
  const Parameters& as() const {
    return dynamic_cast<const Parameters&>(parameters);
  }
};

/// Something of the hardware, or of how it is simulated, that a frame may do without. Declared once, beside the component
/// that it belongs to, before any instance exists.
///
/// A predicate is asked for each instance of the component; the effect is omitted if it can be in all of them.
struct Effect {
  std::string component;       ///< a slot; or what is none: link, clock
  std::string name;            ///< unique in the component: hi_z
  std::string implementation;  ///< of the slot, to which it belongs; empty: to all of them
  EffectKind kind = EffectKind::functional;
  std::string models;
  std::string omitted_when;  ///< the predicate, in words
  std::string elaborates;    ///< what is not there, or not looked at, without it
  std::string tripwire;      ///< where a wrong predicate is noticed
  /// Slots, and links by the names of their sending ends, that are there for it: left out, as PATH or `link.NAME` in a
  /// netlist, where all effects that name them are omitted.
  std::vector<std::string> parts;
  std::function<EffectDecision(const EffectQuestion&)> decide;

  std::string full_name() const { return component + "." + name; }
  /// Whether that is its full name.
  bool is_named(std::string_view full) const {
    const std::size_t dot = component.size();
    return full.size() == dot + 1 + name.size() && full[dot] == '.' && full.substr(0, dot) == component &&
           full.substr(dot + 1) == name;
  }
};

/// All effects of what is linked in or loaded, in the order of their full names by component. A second one of a name is a
/// problem of the registry's.
const std::vector<Effect>& effects();
void add_effect(Effect effect);
/// Throws UserError naming the nearest.
const Effect& effect_named(const std::string& full_name);

/// Declares an effect at program or plugin load.
struct EffectRegistrar {
  explicit EffectRegistrar(Effect effect) { add_effect(std::move(effect)); }
};

/// Which effects a user wants: `auto`, `all`, `approximate`, or a list.
struct EffectChoice {
  enum class Base : std::uint8_t {
    automatic,    ///< those that the frame calls for
    approximate,  ///< and of these none whose absence is bounded
    all,
    none
  };
  Base base = Base::automatic;
  std::vector<std::string> with;     ///< in any case
  std::vector<std::string> without;  ///< left out by force
  /// For tests: what is left out by force is left out in silence, and results are wrong.
  bool tripwires = true;

  static EffectChoice everything() { return {Base::all, {}, {}, true}; }
  /// Of names separated by commas: auto, approximate, all or none first, by default none; NAME takes an effect in, -NAME
  /// leaves it out. Throws UserError for an unknown name.
  static EffectChoice parse(const std::string& text);
  /// That `parse` takes.
  std::string text() const;
  bool forces_out(const std::string& full_name) const;
  bool takes_in(const std::string& full_name) const;
  /// Whether it is elaborated also where nothing calls for it.
  bool elaborates_all_of(const std::string& full_name) const {
    return !forces_out(full_name) && (base == Base::all || takes_in(full_name));
  }
};

/// What a run says of an effect.
struct EffectReport {
  std::string name;
  bool omitted = false;
  EffectProof proof = EffectProof::by_facts;  ///< of what is omitted
  std::string reason;
};

/// What a run leaves out; its units ask by way of gates.
class OmittedEffects {
 public:
  enum class How : std::uint8_t { proved, watched, forced, forced_in_silence };
  struct Omitted {
    std::string name;
    How how = How::proved;
    std::uint64_t uses = 0;  ///< of one that was watched
  };
  void omit(const std::string& name, How how) { omitted_.push_back({name, how, 0}); }
  void leave_out(const std::string& part) { parts_.push_back(part); }
  /// Null for one that is active.
  Omitted* find(const std::string& name);
  bool has_part(const std::string& part) const;
  const std::vector<Omitted>& all() const { return omitted_; }

 private:
  std::vector<Omitted> omitted_;
  std::vector<std::string> parts_;
};

/// The entry of an effect in a unit. What it guards is behind `if (it is called for && gate.enter())`.
class EffectGate {
 public:
  EffectGate() = default;  ///< of an effect that is active
  /// Without effects in the context, as in a testbench, all are active.
  EffectGate(const RenderContext& context, const char* full_name);
  /// Whether it is elaborated from the beginning.
  bool is_active() const { return omitted_ == nullptr; }
  /// The effect is called for: true if it is to be done. If it was left out, that was wrong: the run ends with its name.
  /// SimulationFault where it was proved, UserError where the user did it.
  bool enter() { return omitted_ == nullptr || enter_omitted(); }
  /// Whether `enter` always returns false.
  bool is_silenced() const { return omitted_ != nullptr && omitted_->how == OmittedEffects::How::forced_in_silence; }

 private:
  bool enter_omitted();

  OmittedEffects::Omitted* omitted_ = nullptr;
  std::shared_ptr<OmittedEffects> effects_;
};

}  // namespace vrpipe
