#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe {

namespace {

using How = OmittedEffects::How;

/// What is decided of an effect, over all instances of its component: it is active if any needs it, and watched if any
/// has to be.
EffectDecision both(const EffectDecision& one, const EffectDecision& other) {
  if (!one.omitted) return one;
  if (!other.omitted) return other;
  return one.proof == EffectProof::by_facts ? other : one;
}

bool is_of(const Effect& effect, const Implementation& chosen) {
  return effect.implementation.empty() || chosen.name == effect.implementation;
}

/// What the user wants counts before what the frame calls for.
EffectReport choose(const Effect& effect, const EffectDecision& decision, const EffectChoice& choice) {
  const std::string name = effect.full_name();
  if (choice.forces_out(name) && effect.decide != nullptr)
    return {name, true, EffectProof::by_facts, "left out by force: " + decision.reason};
  const bool is_all = choice.base == EffectChoice::Base::all;
  if (decision.omitted && (is_all || choice.takes_in(name)))
    return {name, false, decision.proof, "asked for: " + decision.reason};
  if (decision.omitted && decision.proof == EffectProof::bounded && choice.base != EffectChoice::Base::approximate)
    return {name, false, decision.proof, "to be approximated: " + decision.reason};
  return {name, decision.omitted, decision.proof, decision.reason};
}

bool reads_statistics(const RunRequest& request) {
  return request.reads_statistics || (request.observers != nullptr && !request.observers->of_statistics().empty());
}

/// In a slot with another implementation than that of the effect. One from outside may be derived from it, or call for
/// the same in a timing model.
EffectDecision decide_for_another(const Effect& effect, const Implementation& chosen) {
  const std::string has = effect.component + " has " + chosen.name;
  if (chosen.trust == Trust::trusted) return EffectDecision::omit(has);
  return EffectDecision::keep(has + ", which may do the same");
}

/// Of an effect that is omitted.
How how_omitted(const std::string& name, const EffectDecision& decision, const EffectChoice& choice) {
  const bool is_proved = decision.omitted && decision.proof == EffectProof::by_facts;
  if (choice.forces_out(name) && !is_proved) return choice.tripwires ? How::forced : How::forced_in_silence;
  switch (decision.proof) {
    case EffectProof::by_facts: break;
    case EffectProof::verified: return How::watched;
    case EffectProof::bounded: return How::forced_in_silence;  // it is called for, and missed
  }
  return How::proved;
}

/// Whether all effects are omitted that a part of the netlist is there for.
bool has_nothing_to_do(OmittedEffects& omitted, const std::string& part) {
  bool any = false;
  for (const Effect& effect : vrpipe::effects()) {
    if (std::find(effect.parts.begin(), effect.parts.end(), part) == effect.parts.end()) continue;
    if (omitted.find(effect.full_name()) == nullptr) return false;
    any = true;
  }
  return any;
}

/// Throws UserError for a memory that is called for and was left out by force: what is bound to it would wait for nothing.
void check_memories(const std::shared_ptr<OmittedEffects>& omitted) {
  RenderContext context;
  context.effects = omitted;
  for (const Effect& effect : vrpipe::effects()) {
    const OmittedEffects::Omitted* const left_out = omitted->find(effect.full_name());
    const bool is_gone = std::any_of(effect.parts.begin(), effect.parts.end(),
                                     [&](const std::string& part) { return !omitted->has_part(part); });
    if (is_gone && left_out != nullptr && left_out->how == How::forced)
      EffectGate(context, left_out->name.c_str()).enter();
  }
}

}  // namespace

void Configuration::decide_effects() {
  for (const auto* names : {&request_.effects.with, &request_.effects.without}) {
    for (const std::string& name : *names) static_cast<void>(effect_named(name));
  }
  for (const std::string& name : request_.effects.without) {
    if (effect_named(name).decide != nullptr) continue;
    throw UserError("cannot leave out " + name, "--effects", effect_named(name).omitted_when, "do not name it");
  }
  elaborated_ = netlist_;
  const ParameterSet none;
  auto omitted = std::make_shared<OmittedEffects>();
  const bool has_time = vrpipe::has_time(request_.fidelity);
  unsigned observed_links = 0;
  if (request_.observers != nullptr) {
    for (const Link& link : netlist_.links()) observed_links += request_.observers->observes_link(link.name()) ? 1 : 0;
  }
  const auto question = [&](const Instance* instance) {
    EffectQuestion asked{*facts_, contexts_[instance == nullptr ? 0 : instance->gpc],
                         instance == nullptr ? none : *units_.at(instance->path).chosen_parameters};
    asked.has_time = has_time;
    asked.counts_work = request_.fidelity != Fidelity::functional;
    asked.observed_links = observed_links;
    asked.reads_statistics = reads_statistics(request_);
    if (instance != nullptr) {
      const std::vector<MemoryLink>& links = elaborated_.memory_links();
      asked.memory_connected =
          std::any_of(links.begin(), links.end(), [&](const MemoryLink& link) { return link.from == instance->path; });
    }
    return asked;
  };
  const auto decide = [&](const Effect& effect, bool is_slot) {
    const auto ask = [&](const Instance* instance) {
      // What is not decided has its reason in place of a predicate.
      return effect.decide == nullptr ? EffectDecision::keep(effect.omitted_when) : effect.decide(question(instance));
    };
    if (!is_slot) return ask(nullptr);
    std::optional<EffectDecision> decision;
    for (const Instance* instance : instances_of(effect.component)) {
      const Implementation& chosen = implementation(*instance);
      const EffectDecision here = is_of(effect, chosen) ? ask(instance) : decide_for_another(effect, chosen);
      decision = decision ? both(*decision, here) : here;
    }
    return decision ? *decision : EffectDecision::omit("the platform has no " + effect.component);
  };
  // Whether units meet memory depends on the memories that are there.
  for (const bool memories : {true, false}) {
    for (const Effect& effect : vrpipe::effects()) {
      const bool is_slot = Registry::instance().has_slot(effect.component);
      if ((is_slot && Registry::instance().slot(effect.component).is_memory) != memories) continue;
      const EffectDecision decision = decide(effect, is_slot);
      effects_.push_back(choose(effect, decision, request_.effects));
      const std::string& name = effects_.back().name;
      if (effects_.back().omitted) omitted->omit(name, how_omitted(name, decision, request_.effects));
    }
    leave_out_parts(*omitted, memories);
    if (!memories) continue;
    check_memories(omitted);
    for (EffectReport& report : effects_) {
      const Effect& effect = effect_named(report.name);
      const auto is_there = [&](const Instance& instance) {
        const bool is_part = std::find(effect.parts.begin(), effect.parts.end(), instance.slot) != effect.parts.end();
        return is_part && is_of(effect, implementation(instance));
      };
      const std::vector<Instance>& there = elaborated_.instances();
      if (!report.omitted || !std::any_of(there.begin(), there.end(), is_there)) continue;
      report.omitted = false;
      report.reason += ", but what is above it, or looks at it, may ask for it";
    }
  }
  for (EffectReport& report : effects_) {
    const Effect& effect = effect_named(report.name);
    if (effect.decide != nullptr) continue;
    if (!omitted->has_part(effect.component)) {
      report = {report.name, true, EffectProof::by_facts, effect.component + " is left out"};
    } else if (has_nothing_to_do(*omitted, effect.component)) {
      report = {report.name, true, EffectProof::by_facts,
                effect.component + " is there to be looked at, and has nothing to do"};
    }
  }
  std::sort(effects_.begin(), effects_.end(),
            [](const EffectReport& a, const EffectReport& b) { return a.name < b.name; });
  for (RenderContext& context : contexts_) context.effects = omitted;
  // The bound follows from them.
  if (reads_statistics(request_) || request_.fidelity == Fidelity::bound)
    EffectGate(contexts_.front(), "cache.details").enter();
}

namespace {
const EffectRegistrar details{
    {"cache",
     "details",
     "",
     EffectKind::timing,
     "causes of misses, and distributions of fills, in the statistics of all sectored caches",
     "nobody reads them (no --json, --html, --interval, --trace), and no `bound` follows from them",
     "which sectors ever were in each cache, and when each on its way was asked for",
     "at elaboration, where statistics are read",
     {},
     [](const EffectQuestion& asked) {
       if (asked.reads_statistics) return EffectDecision::keep("statistics are read");
       if (asked.counts_work && !asked.has_time) return EffectDecision::keep("the bound follows from first fills");
       return EffectDecision::omit("nobody reads statistics");
     }}};
}  // namespace

/// Takes out of the netlist what all effects that elaborate it have omitted. What is looked at from outside stays.
void Configuration::leave_out_parts(OmittedEffects& omitted, bool memories) {
  if (request_.observers != nullptr) return;
  // `implementation`: of a unit; effects of others are none of its own.
  const auto is_left_out = [&](const std::string& part, const std::string& implementation) {
    bool any = false;
    for (const Effect& effect : vrpipe::effects()) {
      if (std::find(effect.parts.begin(), effect.parts.end(), part) == effect.parts.end()) continue;
      if (!effect.implementation.empty() && !implementation.empty() && effect.implementation != implementation)
        continue;
      if (omitted.find(effect.full_name()) == nullptr) return false;
      any = true;
    }
    return any;
  };
  // Of a memory above that stays nobody knows what it asks for.
  const auto is_needed = [&](const Instance& memory) {
    const std::vector<std::string> above = elaborated_.bound_to(memory.path);
    return std::any_of(above.begin(), above.end(), [&](const std::string& path) {
      const Instance* const instance = elaborated_.find(path);
      return instance == nullptr || Netlist::is_memory(*instance);
    });
  };
  const auto is_forced = [&](const std::string& slot) {
    return std::any_of(omitted.all().begin(), omitted.all().end(), [&](const OmittedEffects::Omitted& each) {
      return (each.how == How::forced || each.how == How::forced_in_silence) &&
             effect_named(each.name).component == slot;
    });
  };
  const std::vector<Instance> instances = netlist_.instances();
  for (bool any = true; any;) {
    any = false;
    for (const Instance& instance : instances) {
      if (elaborated_.find(instance.path) == nullptr || Netlist::is_memory(instance) != memories) continue;
      if (!is_left_out(instance.slot, implementation(instance).name)) continue;
      if (memories && is_needed(instance) && !is_forced(instance.slot)) continue;
      memories ? elaborated_.remove_memory(instance.path) : elaborated_.remove(instance.path);
      omitted.leave_out(instance.slot);
      any = true;
    }
  }
  if (memories) return;
  for (const Link& link : netlist_.links()) {
    if (is_left_out(without_gpc(link.name()), "") && elaborated_.link_from(link.from) != nullptr)
      elaborated_.disconnect(link.from);
  }
}

std::vector<EffectReport> Configuration::effects() const {
  std::vector<EffectReport> reports = effects_;
  for (EffectReport& report : reports) {
    const OmittedEffects::Omitted* const omitted = contexts_.front().effects->find(report.name);
    if (omitted == nullptr || omitted->how != How::watched) continue;
    if (omitted->uses > 0) {
      report.omitted = false;
      // Once: it may have been taken in then, and not asked for again.
      report.reason += omitted->uses == 1 ? ": called for" : fmt::format(": called for {} times", omitted->uses);
    } else {
      report.reason += ": never called for";
    }
  }
  return reports;
}

}  // namespace vrpipe
