#include <vrpipe/pipeline/effects.h>

#include <algorithm>
#include <sstream>

#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

const char* name_of(EffectKind kind) { return kind == EffectKind::functional ? "functional" : "timing"; }

const char* name_of(EffectProof proof) {
  switch (proof) {
    case EffectProof::by_facts: return "static";
    case EffectProof::verified: return "verified";
    case EffectProof::bounded: return "bounded";
  }
  return "";
}

namespace {

std::vector<Effect>& effect_list() {
  static std::vector<Effect> all;
  return all;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const std::vector<std::pair<EffectChoice::Base, const char*>>& bases() {
  static const std::vector<std::pair<EffectChoice::Base, const char*>> all{{EffectChoice::Base::automatic, "auto"},
                                                                           {EffectChoice::Base::approximate,
                                                                            "approximate"},
                                                                           {EffectChoice::Base::all, "all"},
                                                                           {EffectChoice::Base::none, "none"}};
  return all;
}

/// @param names  what else may stand where the name does
const Effect& effect_or_word(const std::string& full_name, std::vector<std::string> names) {
  for (const Effect& effect : effect_list()) {
    if (effect.is_named(full_name)) return effect;
  }
  for (const Effect& effect : effect_list()) names.push_back(effect.full_name());
  throw UserError("unknown effect '" + full_name + "'", "--effects", "nothing declares it",
                  suggestion(full_name, names, "`vrpipe units --effects` lists all"));
}

}  // namespace

const std::vector<Effect>& effects() { return effect_list(); }

void add_effect(Effect effect) {
  std::vector<Effect>& all = effect_list();
  const std::string name = effect.full_name();
  for (const std::string& part : {effect.component, effect.name}) {
    if (!is_good_name(part)) return Registry::instance().add_bad_name("component or effect", part);
  }
  if (is_loading_plugin() && effect.decide != nullptr) {
    effect.decide = [what = "effect " + name, decide = std::move(effect.decide)](const EffectQuestion& asked) {
      return call_foreign(what, "decide", 0, [&] { return decide(asked); });
    };
  }
  if (std::any_of(all.begin(), all.end(), [&](const Effect& known) { return known.is_named(name); })) {
    return Registry::instance().add_problem({"there is an effect '" + name + "' already", "choose another name"});
  }
  const auto place = std::upper_bound(all.begin(), all.end(), name, [](const std::string& added, const Effect& other) {
    return added < other.full_name();
  });
  all.insert(place, std::move(effect));
  Registry::instance().count_registration();
}

const Effect& effect_named(const std::string& full_name) { return effect_or_word(full_name, {}); }

EffectChoice EffectChoice::parse(const std::string& text) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError("cannot read the list of effects", "--effects " + text, why, remedy);
  };
  if (text.empty()) refuse("it is empty", "give auto, all, or names");
  EffectChoice choice;
  choice.base = Base::none;
  std::istringstream words(text + ",");
  std::string word;
  for (bool is_first = true; std::getline(words, word, ','); is_first = false) {
    const auto named =
        std::find_if(bases().begin(), bases().end(), [&](const auto& known) { return word == known.second; });
    if (named != bases().end()) {
      if (!is_first) refuse("'" + word + "' comes after another word", "give one of auto, approximate, all, and first");
      choice.base = named->first;
      continue;
    }
    const bool leaves_out = !word.empty() && word.front() == '-';
    if (leaves_out) word.erase(0, 1);
    if (word.empty()) refuse("a name is empty", "give names separated by single commas");
    std::vector<std::string> first_words;
    for (const auto& known : bases()) {
      if (is_first && !leaves_out) first_words.emplace_back(known.second);
    }
    const Effect& effect = effect_or_word(word, first_words);
    const std::string name = effect.full_name();
    if (leaves_out && effect.decide == nullptr) refuse(name + " is always active", "leave -" + name + " away");
    if (leaves_out && is_first) {
      refuse("it does not say of what " + name + " is left out", "write auto or all first: all,-" + name);
    }
    if (contains(choice.with, name) || contains(choice.without, name)) {
      refuse(contains(leaves_out ? choice.without : choice.with, name) ? name + " is named twice"
                                                                       : name + " is both taken in and left out",
             "name it once");
    }
    (leaves_out ? choice.without : choice.with).push_back(name);
  }
  return choice;
}

std::string EffectChoice::text() const {
  std::string all;
  for (const auto& [value, name] : bases()) {
    if (value == base) all = name;
  }
  for (const std::string& name : with) all += "," + name;
  for (const std::string& name : without) all += ",-" + name;
  return all;
}

bool EffectChoice::takes_in(const std::string& full_name) const { return contains(with, full_name); }

bool EffectChoice::forces_out(const std::string& full_name) const {
  return contains(without, full_name) || (base == Base::none && !takes_in(full_name));
}

OmittedEffects::Omitted* OmittedEffects::find(const std::string& name) {
  const auto found =
      std::find_if(omitted_.begin(), omitted_.end(), [&](const Omitted& each) { return each.name == name; });
  return found == omitted_.end() ? nullptr : &*found;
}

bool OmittedEffects::has_part(const std::string& part) const { return !contains(parts_, part); }

EffectGate::EffectGate(const RenderContext& context, const char* full_name) : effects_(context.effects) {
  if (effects_ == nullptr) return;
  omitted_ = effects_->find(full_name);
  const auto is_it = [&](const Effect& effect) { return effect.is_named(full_name); };
  if (omitted_ == nullptr && std::none_of(effects().begin(), effects().end(), is_it))
    throw SimulationFault(std::string("effect ") + full_name, 0, "it has a gate, and nothing declares it");
}

bool EffectGate::enter_omitted() {
  switch (omitted_->how) {
    case OmittedEffects::How::watched: ++omitted_->uses; return true;
    case OmittedEffects::How::forced_in_silence: return false;
    case OmittedEffects::How::proved:
      throw SimulationFault("effect " + omitted_->name, 0,
                            "it was left out, and is called for: its predicate is wrong; --effects all takes it in");
    case OmittedEffects::How::forced: break;
  }
  throw UserError("effect " + omitted_->name + " is called for", "--effects", "it was left out by force",
                  "take it in: --effects auto takes in what a frame calls for");
}

}  // namespace vrpipe
