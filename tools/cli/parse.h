#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/camera.h>

#include "jobs/cycle_window.h"

namespace vrpipe::tools {

// Texts of the command line, read strictly: all of the text must be the value. `option` names the option in messages.
// All throw UserError.

/// A finite number.
double parse_number(const std::string& text, const std::string& option);

/// Percent, as 1% or 0.5: above 0 and up to 100.
double parse_percent(const std::string& text, const std::string& option);

/// A whole number from 1 to `largest`.
unsigned parse_count(const std::string& text, const std::string& option, unsigned largest);

/// Three finite numbers; `form` and `example` show the user what to write, e.g. "X,Y,Z" and "0,-1,0".
Vec3 parse_triple(const std::string& text, const std::string& option, const std::string& form,
                  const std::string& example);

/// "WIDTHxHEIGHT", pixels, both 1 to kMaxImageSize.
ImageSize parse_size(const std::string& text, const std::string& option);

/// "R,G,B", each 0 to 1.
std::array<float, 3> parse_background(const std::string& text, const std::string& option);

/// "NAME,...": at least one, none of them empty.
std::vector<std::string> parse_names(const std::string& text, const std::string& option);

/// "TEXT@FROM:TO": what comes before, and the cycles, of which either may be left out; all without them. What follows an @
/// and has no colon is part of the text.
std::pair<std::string, CycleWindow> parse_window(const std::string& text, const std::string& option);

/// "UNIT.PARAMETER=VALUE" each, of different parameters.
std::vector<Setting> parse_settings(const std::vector<std::string>& texts);

/// "SLOT=IMPLEMENTATION" each, of different slots.
std::vector<UnitChoice> parse_unit_choices(const std::vector<std::string>& texts);

}  // namespace vrpipe::tools
