#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "support/stand_in_scene.h"

namespace vrpipe::testing {

/// A scene that was measured on a GPU and not kept (tests/data/measured_scenes.csv), with the stand-in for it.
struct MeasuredScene {
  std::string name;
  std::map<std::string, double>
      values;  ///< by column: counts, and millions of cycles; what was not measured is not there
  StandIn stand_in;

  std::uint64_t count(const std::string& column) const;
  /// Other splats than those that were measured, of about the same counts.
  Draw draw() const;
};

/// All of them, the three large ones first.
std::vector<MeasuredScene> measured_scenes();

}  // namespace vrpipe::testing
