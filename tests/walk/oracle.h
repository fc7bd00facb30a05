#pragma once

#include <string>
#include <vector>

#include "walk/walk_case.h"

namespace vrpipe::walk {

/// A rule of the outside contract that a case breaks.
struct Finding {
  std::string rule;  ///< a few words; shrinking a case keeps it
  std::string detail;
};

/// Where judging a case reports to.
class Verdict {
 public:
  virtual ~Verdict() = default;
  /// What is done from now on: what a crash or a hang is a finding of.
  virtual void stage(const std::string& name) = 0;
  virtual void finding(const Finding& finding) = 0;
};

/// The rules that one result must keep by itself.
std::vector<Finding> broken_rules(const RunResult& result);

/// The rules between two results of one case: `timed` at any fidelity, `untimed` at functional.
std::vector<Finding> broken_rules(const RunResult& untimed, const RunResult& timed);

/// The rules between two runs without time: of a frame that splits a draw, and of that draw.
std::vector<Finding> broken_split(const RunResult& split, const RunResult& whole);

/// The rules between two runs without time: of a frame in which all is cleared before a draw, and from that draw on.
std::vector<Finding> broken_beginning(const RunResult& frame, std::size_t draw, const RunResult& rest);

/// The rules between two runs of the same request.
std::vector<Finding> broken_repetition(const RunResult& once, const RunResult& again);

/// The rules between two runs of the same request, with other effects that the frame does not call for.
std::vector<Finding> broken_effects(const RunResult& result, const RunResult& other);

/// Runs a case at every fidelity, with stalls, and twice, and checks all rules. Simulates several times in this process.
void judge(const Case& c, Verdict& verdict);

}  // namespace vrpipe::walk
