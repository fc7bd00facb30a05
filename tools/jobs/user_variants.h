#pragma once

#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// A variant of the user's: the base's units and parameters but for these changes.
struct VariantDefinition {
  std::string name;
  std::string base;
  /// SLOT (or a unit's path) and implementation, or UNIT.PARAMETER and value, in the order given.
  std::vector<std::pair<std::string, std::string>> changes;
};

/// "NAME=BASE[,SLOT=IMPLEMENTATION][,UNIT.PARAMETER=VALUE]..."; not checked against what there is. Throws UserError.
VariantDefinition parse_variant(const std::string& text);

/// The same as text.
std::string text_of(const VariantDefinition& definition);

/// Adds it to vrpipe::variants(). Throws UserError for a name that is taken or would not do as one of a file, an unknown
/// base, and a change of what all runs share; that units and parameters exist is checked with the platform.
const Variant& add_user_variant(const VariantDefinition& definition);

/// Adds them all, each after the one that it is based on. Throws UserError, also for one that is based on itself.
void add_user_variants(std::vector<VariantDefinition> definitions);

/// The unit that a variant has in the place of one that is chosen for all; null where it takes that one.
const UnitChoice* own_unit(const Variant& variant, const UnitChoice& choice);

/// What it changes, as in "tgc=pass-through, tc.bins=64".
std::string changes_text(const Variant& variant);

}  // namespace vrpipe::tools
