#pragma once

#include <string>
#include <vector>

#include <vrpipe/pipeline/effects.h>

#include "host/terminal.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// What `vrpipe units` says of effects, in the order of the pipeline and then by name; those of no slot last.
using EffectList = std::vector<const Effect*>;

EffectList all_effects();
/// Of a slot, or of what is none: link, clock.
EffectList effects_of(const std::string& component);

/// Empty for none.
std::string effects_as_text(const EffectList& effects, const TextStyle& style);
/// One table. Empty for none.
std::string effects_as_markdown(const EffectList& effects);
/// A table of those that are decided; under a heading of its own, one of those that are not, with the reasons.
std::string all_effects_as_markdown();
Json effects_as_json(const EffectList& effects);

}  // namespace vrpipe::tools
