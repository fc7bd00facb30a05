#pragma once

#include <cstdio>
#include <cstring>
#include <exception>

#include <vrpipe/platforms/simulation.h>

#include "support/measured_scenes.h"

namespace vrpipe::measured {

/// A program that holds the measured draw to measurements: `[--short] [--fidelity NAME]`, of a draw of few splats and at
/// another fidelity than `lt`. Returns its exit code.
inline int run_of_measured_draw(const char* program, int argc, char** argv,
                                void (*compare)(const Draw&, Fidelity)) try {
  Fidelity fidelity = Fidelity::lt;
  bool is_short = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--short") == 0) {
      is_short = true;
    } else if (std::strcmp(argv[i], "--fidelity") == 0 && i + 1 < argc) {
      fidelity = fidelity_named(argv[++i]);
    } else {
      std::fprintf(stderr, "%s: unknown argument %s\n", program, argv[i]);
      return 2;
    }
  }
  if (fidelity == Fidelity::functional) {
    std::fprintf(stderr, "%s: functional has no time\n", program);
    return 2;
  }
  Draw draw = testing::measured_draw();
  if (is_short) draw.splats.resize(draw.splats.size() / 200);
  compare(draw, fidelity);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s: %s\n", program, error.what());
  return 2;
}

}  // namespace vrpipe::measured
