#pragma once

#include <string>
#include <vector>

#include "host/provenance.h"
#include "host/terminal.h"
#include "jobs/microbench_job.h"

namespace vrpipe::tools {

/// What `vrpipe microbench` has done.
struct MicrobenchRun {
  Provenance provenance;
  RunRequest request;
  unsigned processes = 1;
  std::vector<MicrobenchResult> results;
};

/// One plain sentence: that a figure agrees with what is published, or by how much it differs, and why where that is known.
std::string finding(const MicrobenchFigure& figure);

/// The same of a group of figures: how far they are off.
std::string finding(const MicrobenchGroup& group);
/// Of figures that are judged by themselves, and of groups.
std::vector<std::string> findings(const MicrobenchResult& result);

/// A figure's number as people read it.
std::string number_text(double value);
/// That of the real GPU, with what it is of; "-" for none.
std::string gpu_text(const MicrobenchFigure& figure);

/// What a person reads: for each microbenchmark the figures beside one another, its curves, and the findings.
std::string microbench_text(const MicrobenchRun& run, const TextStyle& style);

}  // namespace vrpipe::tools
