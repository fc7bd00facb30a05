// Effects that end the program, or throw, when they are asked whether a frame calls for them.
#include <cstdlib>
#include <stdexcept>

#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {

vrpipe::Effect effect(const char* name, std::function<vrpipe::EffectDecision(const vrpipe::EffectQuestion&)> decide) {
  vrpipe::Effect made;
  made.component = "qru";
  made.name = name;
  made.models = made.omitted_when = made.elaborates = made.tripwire = "nothing";
  made.decide = std::move(decide);
  return made;
}

const vrpipe::EffectRegistrar leaves(effect("leaves", [](const vrpipe::EffectQuestion&) -> vrpipe::EffectDecision {
  if (std::getenv("DECIDING_THROWS") != nullptr) throw std::runtime_error("no idea");
  std::exit(0);
}));

}  // namespace
